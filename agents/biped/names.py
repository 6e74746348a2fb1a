"""Baselines of the biped by the names that the command line knows."""

BIPED_BASELINES = ("constant-torque", "crank-speed-pi", "computed-torque")
