"""A policy of the package is filmed, and an environment draws itself."""

import sys
from pathlib import Path

import gymnasium

import stickslip
from stickslip.cli import main

for name, start in (("walk.gif", b"GIF8"), ("walk.webp", b"RIFF"), ("walk.mp4", b"\0\0\0")):
    if main(["view", "biped-steady", "--seconds", "0.3", "--out", name]):
        sys.exit(f"{name} was not made by stickslip {stickslip.__version__}")
    if not Path(name).read_bytes().startswith(start):
        sys.exit(f"{name} is none")
env = gymnasium.make("stickslip/UGV-v0", render_mode="rgb_array")
env.reset(seed=0)
if env.render().std() < 1:
    sys.exit("the picture is empty")
