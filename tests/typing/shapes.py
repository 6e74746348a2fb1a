"""Shapes in signatures, held to what is traced: python -m pytest -p tests.typing.checked."""

from collections.abc import Callable, Iterable
from typing import Any, get_type_hints

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

from stickslip.dynamics import Scene, biped
from stickslip.dynamics.ugv import Odometer, PoseSolver, Track, UGVParams, equilibrium, pose
from stickslip.envs import BipedEnv, UGVEnv
from tests.typing.checked import FUNCTIONS, UNREAD

BARS = biped.BipedParams.from_bars
FLOORS = {
    "grip": lambda: Scene.grip(),
    "uniform": lambda: Scene.uniform(0.06, 0.05, payload=1.0),
    "patches": lambda: Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5], outputs="joints"),
}
INTEGRATORS = ("euler", biped.EventExact())
WALKS = [
    ("patches", biped.RK4Split(2, record_events=True)),
    *((floor, "rk4_split") for floor in FLOORS),
    *(("uniform", integrator) for integrator in INTEGRATORS),
]
FIDELITIES = ("reduced", "paper", "joint", biped.Table(8, 5), biped.Chebyshev(16))
POSE_SOLVERS = (PoseSolver(), PoseSolver(iterations=3, samples=0))
TRACKS = {name: (lambda name=name: Track.named(name)) for name in ("bump", "step", "rough")} | {
    "points": lambda: Track.from_points([0.0, 1.0, 2.0, 8.0], [0.0, 0.1, 0.0, 0.0], "linear"),
    "function": lambda: Track.from_function(lambda x: 0.1 * jnp.sin(x)),
}


def first_quick(cases: Iterable[Any]) -> list[Any]:
    """The first is traced in every run; what takes longer together is for the long ones."""
    first, *rest = ((one if isinstance(one, tuple) else (one,)) for one in cases)
    return [pytest.param(*first), *(pytest.param(*one, marks=pytest.mark.long) for one in rest)]


def traced_shapes(function: Callable[[], Any]) -> Any:
    """What a function gives, without its numbers."""
    return jax.eval_shape(function)


def test_every_shape_is_read_where_it_stands():
    assert UNREAD == []


def test_every_annotation_names_what_there_is():
    assert len(FUNCTIONS) > 500
    for function in FUNCTIONS:
        get_type_hints(function, include_extras=True)


@pytest.mark.parametrize("theta", [np.zeros(3), "2"])
def test_what_has_another_shape_or_type_is_refused(theta: Any):
    with pytest.raises(TypeCheckError):
        traced_shapes(lambda: biped.kinematics(BARS(), theta))


NUMBERS = (2, 2.0, np.float32(2), np.asarray(2.0), jnp.ones(()))


@pytest.mark.parametrize("theta", first_quick(NUMBERS))
def test_the_linkage_its_inertia_and_its_forces(theta: Any):
    def everything():
        robot = BARS()
        found = [
            of(robot, theta)
            for of in (biped.kinematics, biped.reduced_inertia, biped.ground_moment)
        ]
        forces = biped.inverse_dynamics(robot, theta, 3.0, 0.0, outputs="joints")
        motion = biped.forward_dynamics(robot, theta, 3.0, 0.1, 1.0, 0.5, 0.4, outputs="joints")
        return (
            found,
            biped.exchange_mismatch(robot),
            biped.floor_position(robot, biped.BipedState()),
            forces,
            motion,
        )

    traced_shapes(everything)


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.long
def test_a_step_of_every_fidelity(fidelity: Any):
    state = biped.BipedState(crank_rate=1.0)
    traced_shapes(lambda: biped.step(BARS(), Scene.grip(), state, 1.0, 0.01, fidelity=fidelity))


@pytest.mark.parametrize(("floor", "integrator"), WALKS)
@pytest.mark.long
def test_walks(floor: str, integrator: Any):
    def walk():
        given = (BARS(), FLOORS[floor](), biped.BipedState())
        return biped.simulate(*given, lambda now: 1.0, 0.02, 0.01, integrator=integrator)

    traced_shapes(walk)


@pytest.mark.parametrize("track", first_quick(TRACKS))
def test_tracks(track: str):
    def everything():
        ground = TRACKS[track]()
        places = jnp.linspace(1.0, 3.0, 6).reshape(2, 3)
        heights = ground.height(places), ground.slope(1.5), ground.profile(2)
        return heights, Odometer.along(ground).distance(places)

    traced_shapes(everything)


@pytest.mark.parametrize("solver", first_quick(POSE_SOLVERS))
def test_poses_and_their_equilibrium(solver: PoseSolver):
    def everything():
        vehicle, ground = UGVParams(wheel_radius=0.3), Track.bump()
        angles = jnp.full((2, 3, 2), 1.5)
        return (
            pose(vehicle, ground, 3.0, [1.5, 1.6], solver=solver),
            equilibrium(vehicle, ground, [3.0, 4.0], [[1.5, 1.6], [1.6, 1.5]], solver=solver),
            equilibrium(vehicle, ground, np.ones(3), angles, jnp.ones(3), solver=solver),
        )

    traced_shapes(everything)


@pytest.mark.parametrize(
    ("env", "options"),
    first_quick([(BipedEnv(see_patch=True), {"scene": FLOORS["patches"]}), (UGVEnv(), {})]),
)
def test_an_episode_of_every_environment(env: Any, options: dict[str, Callable[[], Any]]):
    fixed = None if options else env.default_params  # the UGV's waypoints are counted before

    def everything(key):
        params = fixed or env.make_params(**{name: made() for name, made in options.items()})
        obs, state = env.reset(key, params)
        action = jnp.zeros(len(env.action_names), obs.dtype)
        return env.step(key, state, action, params), env.step(
            key, state, [0.0] * len(action), params
        )

    jax.eval_shape(everything, jax.random.key(0))
