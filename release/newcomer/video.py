"""Gymnasium's own recorder."""

import sys
from pathlib import Path

import gymnasium

import stickslip  # noqa: F401  (registers the environments)

env = gymnasium.make("stickslip/Biped-v0", render_mode="rgb_array")
env = gymnasium.wrappers.RecordVideo(env, "films", video_length=5, disable_logger=True)
env.reset(seed=0)
for _ in range(6):
    env.step(env.action_space.sample())
env.close()
if not [path for path in Path("films").glob("*.mp4") if path.stat().st_size > 1000]:
    sys.exit("no film")
