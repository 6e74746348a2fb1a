"""TorchRL over the Gymnasium ids."""

import sys

import gymnasium
from torchrl.envs import GymWrapper

import stickslip  # noqa: F401  (registers the environments)

env = GymWrapper(gymnasium.make("stickslip/BipedSteady-v0"), device="cpu")
env.set_seed(0)
steps = env.rollout(20)["next"]
if len(steps) < 1 or not steps["reward"].isfinite().all():
    sys.exit(f"no steps, or no rewards: {steps}")
