# pyright: strict
"""What a user of every part writes first, in their own words; checked as strictly as may be."""

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents import ComputedTorque, evaluate
from stickslip.dynamics import Scene, Status, recommend
from stickslip.dynamics.biped import BipedParams, BipedState, kinematics, simulate, step
from stickslip.dynamics.ugv import Track, UGVParams, equilibrium
from stickslip.envs import BipedEnv, GymEnv, Randomisation, UGVEnv
from stickslip.optim import PostureProblem, solve

robot = BipedParams.from_bars(bar_density=1.5, payload=2, hip_centre=[1.0, -6.0])
floor = Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5], payload=1.0)
walk = simulate(robot, floor, BipedState(crank_rate=2.0), np.full(50, 0.9), 0.5, dt=0.01)
held = simulate(robot, floor, BipedState(), lambda now: 1.0 - 0.1 * now.crank_rate, 0.5, 0.01)
angles: list[float] = np.asarray(walk.states.crank_angle).tolist()
fell = bool(walk.status > Status.SLIP_ONSET)
state, contact = step(robot, Scene.uniform(0.5), walk.final, torque=1, dt=0.01)
height = float(kinematics(robot, 2.0).centres[12, 1]) + float(contact.normal_force)


def closure(theta: jax.Array) -> jax.Array:
    """How far the linkage is from coming apart."""
    return kinematics(robot, theta).closure


margins = jax.vmap(closure)(walk.states.phase)
setting = recommend(1e-4, floor, batch=64).setting

ground = Track.from_points([0.0, 1.0, 2.0, 8.0], [0.0, 0.1, 0.0, 0.0])
hill = Track.from_function(lambda x: 0.1 * jnp.sin(x), start=0, end=12)
forces = equilibrium(UGVParams(wheel_radius=0.3), hill, [1.0, 2.0], [1.5, 1.6], friction=0.6)
worst = float(jnp.min(forces.grip_rear)) + float(ground.height(1.5))

env = BipedEnv(see_patch=True, setting=setting)
params = env.make_params(scene=floor, randomisation=Randomisation(payload=(0.0, 2.0)))
key = jax.random.key(0)
obs, now = env.reset(key, params)
obs, now, reward, over, late, info = env.step(key, now, [0.1], params)
print(float(reward), bool(over | late), info["status"], obs.shape, now.biped.phase)

adapter = GymEnv(BipedEnv(autoreset="disabled"), BipedEnv().default_params)
first, told = adapter.reset(seed=1)
after, gain, ended, cut, told = adapter.step([0.2])
table = evaluate(env, {"mine": ComputedTorque()}, {"ice": params}, episodes=4)
print(table.to_text(), first + after, gain, ended or cut, told, UGVEnv().default_params.start)

problem = PostureProblem.along(ground, "wheel_energy", spacing=0.5, leg_rate=1.0)
result = solve(problem, method="dp", polish=False, progress=False)
if result.x is not None:
    print(problem.objective(result.x), problem.constraints(list(result.x)).min(), result.leg_angles)
