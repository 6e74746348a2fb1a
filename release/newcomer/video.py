"""Gymnasium's own recorder."""

import sys
from pathlib import Path

import gymnasium

import stickslip  # noqa: F401  (registers the environments)

env = gymnasium.make("stickslip/Biped-v0", render_mode="rgb_array")
env = gymnasium.wrappers.RecordVideo(env, "films", episode_trigger=lambda _: True)
env.reset(seed=0)
for _ in range(6):
    env.step([0.1])
env.close()
if not [path for path in Path("films").glob("*.mp4") if path.stat().st_size > 1000]:
    sys.exit("no film")
