"""A sweep, its files and its picture."""

import sys

from stickslip.agents import read_sweep
from stickslip.cli import main

SWEEP = ["sweep", "biped", "--policy", "crank-speed-pi", "--episodes", "2"]
if main([*SWEEP, "--axis", "mu=0.05,0.2", "--axis", "payload=0,5", "--out", "grid"]):
    sys.exit("the sweep failed")
if read_sweep("grid").num_rows != 8:
    sys.exit("rows are missing")
