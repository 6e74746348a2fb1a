"""Training with Stable-Baselines3."""

from stickslip.envs.rendering.extras import require

require("stable_baselines3", "the trainer sb3", "sb3")
