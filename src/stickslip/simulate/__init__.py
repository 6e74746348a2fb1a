"""`stickslip simulate`: a walk under a torque, a drive with given leg angles, as data and picture.

The physics are `dynamics.biped.simulation` and the stations of a posture problem; here are the
flags (`flags.py`), what a torque or a posture may be given as (`torque.py`,
`expression.py`, `posture.py`), the runs (`walk.py`, `biped.py`, `ugv.py`) and the
files (`files.py`, `picture.py`).
"""
