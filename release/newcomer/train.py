"""A policy is trained by the command line, with plots and an animation, and scored."""

import sys
from importlib.util import find_spec
from pathlib import Path

from stickslip.cli import main

TRAIN = ["--timesteps=256", "--num-envs=4", "--rollout-steps=32", "--batch-size=64", "--hidden=8"]
TRAIN += ["--evaluation-episodes=2", "--checkpoint-interval=128", "--epochs=1"]

if find_spec("torch") is not None:
    sys.exit("PyTorch came along")
if main(["train", "biped", "--out", "run", *TRAIN]):
    sys.exit("training failed")
missing = {"policy.npz", "learning.png", "episode.png", "walk.gif"} - {
    path.name for path in Path("run").iterdir()
}
if missing or not list(Path("run/tensorboard").iterdir()):
    sys.exit(f"the run lacks {missing or 'TensorBoard files'}")
if main(["evaluate", "run", "crank-speed-pi", "--episodes", "2"]):
    sys.exit("evaluation failed")
if main(["train", "biped", "--out", "other", "--trainer", "sb3", *TRAIN]) != 2:
    sys.exit("Stable-Baselines3 was not asked for")
