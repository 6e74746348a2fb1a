"""Names of the biped that the command line knows, and of what its runs leave."""

BIPED_BASELINES = ("constant-torque", "crank-speed-pi", "computed-torque", "optimal-gait")
FILM, FRAMES = "walk.gif", 25.0
"""The animation of a finished run, and its pictures a second."""
