"""A motor's limit of power and its efficiency: what they take away, and that None costs nothing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from stickslip.envs import BipedEnv, Randomisation
from stickslip.optim import GaitProblem, solve
from stickslip.optim.gait.footing import Footing
from stickslip.optim.result import OptimStatus


@pytest.mark.parametrize("integrator", ["rk4_split", "event_exact"])
@pytest.mark.usefixtures("float64")
def test_power_is_limited_at_every_instant_and_all_work_becomes_energy(integrator):
    robot, start = BipedParams.from_bars(), BipedState(crank_rate=1.0)
    how = {"integrator": integrator, "max_power": 3.0}
    walk = simulate(robot, Scene.grip(outputs="state"), start, 2.0, 0.4, 0.002, **how)
    states, footing = jax.tree.map(np.asarray, walk.states), Footing.of(robot)
    power = np.asarray(walk.torques) * states.crank_rate[1:]
    assert power.max() == pytest.approx(3.0)
    assert power.min() > 1.9  # 2 N m until then
    energy = footing.profiles.at(states.phase).M * states.crank_rate**2 / 2
    energy += footing.height(states.phase)
    np.testing.assert_allclose(np.diff(energy), walk.contacts.work, atol=2e-8)


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


def test_a_gait_pays_for_losses_and_is_no_answer_beyond_the_power():
    how = {"mu": 0.1, "mean_rate": 3.0, "torque_limit": 4.0, "steps": 40}
    robot, values = BipedParams.from_bars(), []
    for efficiency in (1.0, 0.5):
        found = solve(GaitProblem.periodic(robot, "energy", efficiency=efficiency, **how))
        spent = found.gait.spent_on_grid
        expected = spent["work"] / efficiency + 0.5 * spent["torque"]
        assert found.value == pytest.approx(expected, rel=1e-9)
        values.append(found.value)
    assert values[1] > values[0]
    weak = GaitProblem.periodic(robot, "energy", max_power=found.gait.largest_power / 2, **how)
    broken = solve(weak)
    assert broken.status is OptimStatus.VIOLATED
    assert not broken.feasible
    assert "power" in broken.message
    enough = GaitProblem.periodic(robot, "energy", max_power=100.0, **how)
    assert solve(enough).status is OptimStatus.OPTIMAL
