"""Value iteration and the policy that looks ahead, against optima that are known."""

from dataclasses import dataclass, replace
from functools import partial

import hypothesis.strategies as st
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given

from benchmarks import optimum
from benchmarks.imitation import SHARPNESS, Drive, before_steps, costs, turns, whole
from benchmarks.optimum import Grid, Walk, finite_horizon, look_ahead, solve, transitions
from stickslip import optim
from stickslip.agents import ComputedTorque
from stickslip.agents.biped.task import from_anywhere
from stickslip.agents.evaluation.rollout import play
from stickslip.agents.evaluation.table import keep_of
from stickslip.dynamics import Scene
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs import BipedEnv, UGVEnv, task_by_name
from stickslip.envs.tasks.known import Scale

ENV = BipedEnv(autoreset="disabled")
UNEVEN = np.array([-1.0, -0.9, 0.2, 1.0, 4.0])
EVEN = np.linspace(0.0, 2.0, 4)
GRID = Grid(((UNEVEN, EVEN), (np.linspace(-1.0, 1.0, 3), UNEVEN, UNEVEN + 5)))


def multilinear(sheet: int, a, b, c):
    """Linear along every axis: what multilinear interpolation gives back."""
    return 1 + 2 * a - b + 3 * a * b if sheet == 0 else a - b * c + 2 * a * b * c


def values(dtype):
    sheets, nodes = GRID.nodes
    parts = [multilinear(sheet, *nodes[sheets == sheet].T) for sheet in range(2)]
    return jnp.asarray(np.concatenate(parts), dtype)


@jax.jit
def read(values, sheet, at):
    place = GRID.place(sheet, at)
    return GRID.read(values, place), place.outside


inside = st.floats(0.0, 1.0)


@given(sheet=st.integers(0, 1), shares=st.tuples(inside, inside, inside))
def test_functions_linear_along_every_axis_are_read_exactly(float64, sheet, shares):
    ends = [(one[0], one[-1]) for one in GRID.sheets[sheet]] + [(0, 0)]
    at = [low + share * (high - low) for (low, high), share in zip(ends, shares, strict=False)]
    found, outside = read(values(float64), sheet, jnp.asarray(at))
    assert not outside
    assert float(found) == pytest.approx(multilinear(sheet, *at), abs=1e-12)


def test_a_periodic_axis_wraps_and_what_no_node_covers_is_outside(dtype):
    ring = Grid(((np.linspace(1.0, 3.0, 5),),), periodic=True)
    given = jnp.asarray([1.25, 3.25, -0.75, 101.25], dtype)[:, None]
    np.testing.assert_allclose(jax.vmap(partial(ring.place, 0))(given).at, 0.5, atol=1e-4)
    for at in (-1.1, 4.1, 1e30, float("inf"), float("nan")):
        found, outside = read(values(dtype), 0, jnp.asarray([at, 0.0, 0.0], dtype))
        assert outside
        assert np.isfinite(found)


class OneSheet:
    """Processes whose states are coordinates."""

    def state(self, sheet, at):
        return at

    def place(self, state):
        return self.grid.place(0, state)


@register_pytree
@dataclass(frozen=True)
class Chain(OneSheet):
    """Places 0 to 5 on a line; a move costs 1/8. The right end pays 2 and ends; left is nothing."""

    actions: jax.Array
    grid: Grid
    outside: float = -50.0

    def step(self, state, action):
        after = state + action
        ended = after[0] > 4.5
        reward = jnp.where(ended, 2.0, 0.0) - 0.125 * jnp.abs(action[0])
        return after, reward.astype(state.dtype), ended


def chain(dtype=jnp.float32):
    line = Grid(((np.linspace(0.0, 5.0, 6),),))
    return Chain(jnp.asarray([[-1.0], [0.0], [1.0]], dtype), line)


def test_a_chain_has_the_values_counted_by_hand(dtype):
    grid, table = chain().grid, transitions(chain(dtype))
    found = finite_horizon(grid, table, 4)
    # From the place 5 - n the prize is n moves away; place 5 itself is where one step more ends it.
    assert found.dtype == dtype
    assert found.tolist() == [0.0, 1.5, 1.625, 1.75, 1.875, 2.0]
    assert finite_horizon(grid, table, 5).tolist()[0] == 2 - 5 * 0.125


@register_pytree
@dataclass(frozen=True)
class DoubleIntegrator(OneSheet):
    """x' = x + h v, v' = v + h u; reward -h (x^2 + v^2 + u^2 / 4)."""

    actions: jax.Array
    grid: Grid
    h: float = 0.2
    outside: float = -1e3

    def step(self, state, action):
        x, v = state
        reward = -self.h * (x**2 + v**2 + action[0] ** 2 / 4)
        after = jnp.stack([x + self.h * v, v + self.h * action[0]])
        return after, reward, jnp.zeros((), bool)

    def riccati(self, steps):
        """The matrix of -value of so many steps, in NumPy."""
        A, B = np.array([[1, self.h], [0, 1]]), np.array([[0], [self.h]])
        Q, R = self.h * np.eye(2), np.array([[self.h / 4]])
        S = np.zeros((2, 2))
        for _ in range(steps):
            gain = np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)
            S = Q + A.T @ S @ (A - B @ gain)
        return S


@pytest.mark.long
def test_a_regulator_has_riccatis_value_and_the_error_falls_with_the_square_of_the_cells(float64):
    errors, at = [], np.mgrid[-1:1:9j, -1:1:9j].reshape(2, -1).T
    for cells in (32, 64):
        axes = np.linspace(-3.0, 3.0, cells + 1), np.linspace(-4.0, 4.0, cells + 1)
        tried = jnp.linspace(-6, 6, 81, dtype=float64)[:, None]
        process = DoubleIntegrator(tried, Grid((axes,)))
        exact = -np.einsum("ni,ij,nj->n", at, process.riccati(20), at)
        value = finite_horizon(process.grid, transitions(process), 20)
        found = jax.vmap(lambda one, p=process, v=value: p.grid.read(v, p.place(one)))
        errors.append(np.max(np.abs(found(jnp.asarray(at)) - exact)))
    assert errors[1] < 0.05 * np.max(np.abs(exact))
    assert errors[0] / errors[1] > 3


@pytest.mark.parametrize(
    ("task", "names"),
    [
        ("BipedSteady-v0", ()),
        ("BipedHiddenFriction-v0", ("friction", "mean_rate")),
        ("BipedPayload-v0", ("mass", "payload")),
        ("BipedIce-v0", ("place",)),
        ("BipedStop-v0", ("to_go",)),
    ],
)
def test_nodes_and_states_are_each_others_inverses(task, names):
    env, params = task_by_name(task).make()
    walk = Walk.of(env, params)
    assert walk.names == names
    middle = [axis[len(axis) // 2] + 0.003 for axis in walk.grid.sheets[0][2:]]
    at = jnp.asarray([2.0, 3.5, *middle, 0.05], jnp.float32)
    sheets = jnp.arange(3, dtype=jnp.int8)
    states = jax.jit(jax.vmap(walk.state, (0, None)))(sheets, at)
    assert np.sign(states.biped.foot_velocity).tolist() == [0, 1, -1]
    places, asked = jax.jit(jax.vmap(lambda *of: (walk.place(of[0]), walk.grid.place(of[1], at))))(
        states, sheets
    )
    np.testing.assert_allclose(places.at, asked.at, atol=1e-4)
    assert places.sheet.tolist() == [0, 1, 2]
    assert not np.any(places.outside)
    beyond = walk.state(sheets[0], at.at[2:-1].add(99.0))
    ends = [len(axis) - 1 for axis in walk.grid.sheets[0][2:]]
    assert walk.place(beyond).at[2 : len(at) - 1].tolist() == ends


def test_looking_ahead_with_every_path_is_worth_as_many_steps_more():
    process, table = chain(), transitions(chain())
    near, far = (finite_horizon(process.grid, table, count) for count in (4, 6))
    found = [look_ahead(process, near, jnp.asarray([float(at)]), 2, 3**2)[1] for at in range(6)]
    np.testing.assert_array_equal(found, far)


def test_choices_that_are_held_earn_less_until_they_are_the_best(dtype):
    grid, table = chain().grid, transitions(chain(dtype))
    best, held, long = (finite_horizon(grid, table, *of) for of in ((6,), (6, 3), (18, 3)))
    assert held.tolist() == [0.0, 0.0, 0.0, 1.75, 1.875, 2.0]
    assert long.tolist() == best.tolist()


@pytest.mark.long
def test_a_teacher_is_asked_about_the_states_that_the_observations_are_of():
    env, params = task_by_name("BipedStop-v0").make()
    short = params.shortened(5)
    (obs, states), real = before_steps(play(env, ComputedTorque(), short, range(3), whole))
    assert real.all()
    assert sorted(states.elapsed.tolist()) == sorted([*range(5)] * 3)
    np.testing.assert_allclose(obs[:, 2], states.biped.crank_rate, rtol=1e-6)
    np.testing.assert_allclose(obs[:, 6], states.drawn.mark - states.totals.walked, rtol=1e-6)


@pytest.mark.long
def test_at_six_radians_a_second_the_policy_stays_up_where_computed_torque_falls(monkeypatch):
    monkeypatch.setattr(optimum, "CELLS", {"rest": (86, 96), "slide": (22, 24)})
    scene = Scene.uniform(0.06, 0.05)
    params = from_anywhere(ENV.make_params(mean_rate=6.0, scene=scene))
    found = play(ENV, solve(Walk.of(ENV, params, 31)), params, range(48), keep_of)
    others = play(ENV, ComputedTorque(), params, range(48), keep_of)
    assert not found.fell.any()
    assert np.mean(others.fell) > 0.05
    assert found.reward.mean() > 8.6


@pytest.mark.parametrize("criterion", ["wheel_energy", "grip"])
@pytest.mark.long
def test_the_teacher_of_drives_agrees_with_the_optimiser_on_its_grid(criterion):
    env = UGVEnv(criterion=criterion, autoreset="disabled")
    legs = np.linspace(np.pi / 6, 5 * np.pi / 6, 9)
    params = env.make_params(spacing=0.4)
    rate = (legs[1] - legs[0]) / float(params.spacing)  # a step of the grid in one of the drive
    params = params.replace(leg_rate=rate)
    state = env.reset(jax.random.key(0), params)[1]
    problem = replace(env.problem(state, params), leg_rate=1.01 * rate)  # roundings
    wanted = optim.solve(problem, "dp", polish=False, angles=len(legs)).value
    scale = Scale(0.0, 1.0) if criterion == "wheel_energy" else Scale(-wanted - 100.0, -wanted)
    grid = Grid(((np.arange(len(problem.x)), legs, legs),))
    drive = Drive(params, state.drawn, turns(3)[1], grid, scale, env)
    values = finite_horizon(grid, transitions(drive), len(problem.x) - 1)
    found = grid.read(values, drive.place(state))
    if criterion == "grip":
        worst = -scale.earned(-float(jnp.log(-found)) / SHARPNESS)  # about the worst of the places
        assert wanted - 1 < worst < wanted + 100 / SHARPNESS * np.log(len(problem.x)) + 1
    else:
        assert float(found) == pytest.approx(-wanted, rel=1e-3)
    lost = costs(drive, values, jax.tree.map(lambda leaf: leaf[None], state))
    assert lost.shape == (1, 9)
    assert float(lost.min()) == pytest.approx(0.0, abs=1e-6)
    assert float(lost.max()) > 1e-3
