"""The core alone: an environment, a policy of the package, a posture, and the command line."""

import importlib.util
import sys
from pathlib import Path

import gymnasium
import jax

import stickslip
from stickslip.agents import load_policy
from stickslip.cli import main
from stickslip.dynamics.ugv import Track
from stickslip.envs import BipedEnv
from stickslip.optim import PostureProblem, solve

if not Path(stickslip.__file__).is_relative_to(sys.prefix):
    sys.exit(f"another stickslip was imported: {stickslip.__file__}")

env = gymnasium.make("stickslip/Biped-v0")
policy, (obs, _) = load_policy("biped-steady"), env.reset(seed=0)
for _ in range(50):
    obs, reward, terminated, _, info = env.step(policy(obs))
    if terminated or obs not in env.observation_space:
        sys.exit(f"the policy of the package fell: {obs}, {info}")

functional, key = BipedEnv(), jax.random.key(0)
obs, state = functional.reset(key, functional.default_params)
obs, state, reward, *_ = functional.step(key, state, jax.numpy.ones(1), functional.default_params)
if not jax.numpy.isfinite(reward):
    sys.exit(f"the reward is {reward}")

problem = PostureProblem.along(Track.bump(), "total_energy", spacing=1.0)
result = solve(problem, method="dp", polish=False)
if not (result.status.solved and result.value >= result.details["grid_bound"]):
    sys.exit(f"the posture was not solved: {result}")

if main(["tasks", "BipedIce-v0"]) or main(["evaluate", "biped-steady", "--episodes", "2"]):
    sys.exit("a command failed")
optional = (("matplotlib", ["view", "biped-steady", "--out", "a.gif"]), ("tensorboard", ["train"]))
for package, command in optional:
    if importlib.util.find_spec(package) is None and main(command) != 2:
        sys.exit(f"{command} does without {package}")
