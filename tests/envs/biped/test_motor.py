"""A motor's limit of power, efficiency and delay: what they do, and that None costs nothing."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from stickslip.envs import BipedEnv, Randomisation
from stickslip.optim import GaitProblem, solve
from stickslip.optim.gait.footing import Footing
from stickslip.optim.problem import OptimStatus


@pytest.mark.parametrize("integrator", ["rk4_split", "event_exact"])
@pytest.mark.usefixtures("float64")
def test_power_is_limited_at_every_instant_and_all_work_becomes_energy(integrator):
    robot, start = BipedParams.from_bars(), BipedState(crank_rate=1.0)
    how = {"integrator": integrator, "max_power": 3.0}
    walk = simulate(robot, Scene.grip(outputs="state"), start, 2.0, 0.4, 0.002, **how)
    states, footing = jax.tree.map(np.asarray, walk.states), Footing.of(robot)
    power = np.asarray(walk.contacts.torque) * states.crank_rate[1:]
    assert power.max() == pytest.approx(3.0)
    assert power.min() > 1.9  # 2 N m until then
    energy = footing.profiles.at(states.phase).M * states.crank_rate**2 / 2
    energy += footing.height(states.phase)
    np.testing.assert_allclose(np.diff(energy), walk.contacts.work, atol=2e-8)
    turned = np.diff(states.phase + np.pi * states.steps)
    np.testing.assert_allclose(walk.torques * turned, walk.contacts.work, rtol=1e-5)
    np.testing.assert_array_equal(walk.torques[power < 2.9], 2.0)


def test_the_environment_saturates_and_pays_for_losses():
    env = BipedEnv(autoreset="disabled")
    how = {"scene": "grip", "randomisation": Randomisation(crank_rate=(2.0, 2.0))}
    plain, limited = env.make_params(**how), env.make_params(max_power=0.4, efficiency=0.5, **how)
    assert jax.tree.structure(plain) == jax.tree.structure(env.make_params(max_power=None, **how))
    assert "power" not in repr(jax.tree.structure(plain))
    step, infos = jax.jit(env.step_env), []
    for params in (plain, limited):
        _, state = env.reset(jax.random.key(0), params)
        for _ in range(3):
            *_, info = out = step(state, jnp.array([0.25]), params)
            state = out[1]
        infos.append((float(state.biped.crank_rate), info))
    (free, _), (rate, info) = infos
    assert 0.4 < rate < free
    assert info["torque"] * rate == pytest.approx(0.4, rel=1e-5)
    work, loss = float(info["positive_work"]), float(info["copper_loss"])
    speed = 3 / np.pi * float(plain.robot.step_length) * float(plain.robot.own_mass) * 9.81
    assert -info["reward_energy"] == pytest.approx(0.5 * (2 * work + loss) / speed, rel=1e-4)
    with pytest.raises(ValueError, match=r"efficiency = 1\.2 .*accepted: None, or above 0 up to 1"):
        env.make_params(efficiency=1.2)


def test_a_delayed_motor_applies_the_actions_of_some_periods_before():
    env, given = BipedEnv(autoreset="disabled"), np.linspace(0.1, 0.2, 8)
    params, key = env.make_params(randomisation=Randomisation(phase=(2.0, 4.0))), jax.random.key(1)

    def walked(env, actions):
        (_, state), step = env.reset(key, params), jax.jit(env.step_env)
        for action in actions:
            _, state, *_, info = step(state, jnp.array([action]), params)
        return state.biped, info

    late = walked(replace(env, delay=3), given), walked(env, [0, 0, 0, *given[:-3]])
    jax.tree.map(np.testing.assert_array_equal, *late)
    with pytest.raises(ValueError, match=r"delay = -1; accepted: an integer >= 0"):
        replace(env, delay=-1)


def test_a_gait_pays_for_losses():
    how = {"mu": 0.1, "mean_rate": 3.0, "torque_limit": 4.0, "steps": 40}
    robot, values = BipedParams.from_bars(), []
    for efficiency in (1.0, 0.5):
        found = solve(GaitProblem.periodic(robot, "energy", efficiency=efficiency, **how))
        spent = found.gait.spent_on_grid
        expected = spent["work"] / efficiency + 0.5 * spent["torque"]
        assert found.value == pytest.approx(expected, rel=1e-9)
        values.append(found.value)
    assert values[1] > values[0]


LIMITS = {"mu": 0.3, "torque_limit": 4.0, "steps": 40}


@pytest.mark.parametrize("objective", ["time", "energy"])
def test_a_gait_within_the_power_is_a_local_optimum(objective):
    """SLSQP, which knows nothing of tangents, finds none that is better near it."""
    robot = BipedParams.from_bars()
    how = LIMITS | ({"mean_rate": 3.0} if objective == "energy" else {})
    free = solve(GaitProblem.periodic(robot, objective, **how))
    power = 0.9 * free.gait.power_at_nodes
    problem = GaitProblem.periodic(robot, objective, max_power=power, **how)
    found = solve(problem)
    assert found.status is OptimStatus.FEASIBLE
    assert found.gait.power_at_nodes == pytest.approx(power, rel=1e-6)
    assert found.held is not None
    assert found.held.largest_power <= power * (1 + 1e-6)
    assert found.lower_bound == pytest.approx(free.lower_bound, rel=1e-9)
    assert found.value > free.value
    polished = solve(problem, method="gradient", start=found.x)
    assert polished.value > found.value * (1 - 1e-5)


def test_power_that_is_never_reached_changes_nothing_and_too_little_is_violated():
    robot = BipedParams.from_bars()
    enough = solve(GaitProblem.periodic(robot, max_power=1e3, **LIMITS))
    assert enough.status is OptimStatus.OPTIMAL
    assert enough.value == solve(GaitProblem.periodic(robot, **LIMITS)).value
    broken = solve(GaitProblem.periodic(robot, mean_rate=5.0, max_power=0.5, **LIMITS))
    assert broken.status is OptimStatus.VIOLATED
    assert broken.residuals["power"] == pytest.approx(broken.gait.power_at_nodes - 0.5)
    assert "no gait was found within max_power = 0.5 W" in broken.message


def test_a_limit_of_power_is_no_convex_program():
    with pytest.raises(ValueError, match="max_power is not a convex limit; accepted: None"):
        GaitProblem.periodic(BipedParams.from_bars(), max_power=5.0, **LIMITS).in_cvxpy()
