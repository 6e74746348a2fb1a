"""Measured settings, out of `python -m benchmarks.ugv --update`: not by hand.

Points that none of the same precision and checks beats in cost and in both errors.
"""

from __future__ import annotations

from stickslip.dynamics.ugv.pose_solver import PoseSolver

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit f59045d, 2026-11-21"
"""Processor, versions, commit and day."""

SETTINGS = (
    (PoseSolver(samples=0), "float64", None),
    (PoseSolver(samples=0), "float32", None),
    (PoseSolver(samples=0), "float32", 8),
    (PoseSolver(), "float32", None),
    (PoseSolver(), "float64", None),
    (PoseSolver(), "float32", 8),
    (PoseSolver(iterations=1, samples=0), "float32", None),
    (PoseSolver(iterations=3, samples=0), "float32", None),
    (PoseSolver(iterations=4, samples=0), "float32", None),
    (PoseSolver(iterations=3, samples=0), "float32", 16),
    (PoseSolver(iterations=2, samples=0), "float32", 16),
    (PoseSolver(iterations=2, samples=0), "float64", None),
    (PoseSolver(iterations=3), "float32", None),
    (PoseSolver(iterations=3), "float64", None),
    (PoseSolver(iterations=3), "float32", 16),
    (PoseSolver(samples=0), "float32", 32),
    (PoseSolver(samples=0), "float64", 64),
    (PoseSolver(), "float32", 32),
    (PoseSolver(), "float64", 64),
    (PoseSolver(tolerance=0.01, samples=0), "float32", 4),
    (PoseSolver(tolerance=0.01, samples=0), "float32", 16),
    (PoseSolver(iterations=2, samples=0), "float64", 16),
)
"""Solver, dtype, pieces of a table for each metre."""

ROWS = (
    ("bump", 0, 1, 1e-15, 1e-14, 2.81e-05),
    ("bump", 1, 1, 8.31e-08, 7.82e-07, 2.86e-05),
    ("bump", 2, 1, 5.79e-08, 7.82e-07, 3.03e-05),
    ("bump", 3, 1, 8.31e-08, 7.82e-07, 0.000123),
    ("bump", 4, 1, 1e-15, 1e-14, 0.000139),
    ("bump", 5, 1, 5.79e-08, 7.82e-07, 0.000269),
    ("bump", 6, 16384, 5.82e-08, 7.82e-07, 7.37e-08),
    ("bump", 7, 16384, 5.63e-08, 7.82e-07, 8.09e-08),
    ("bump", 8, 16384, 8.31e-08, 7.64e-07, 9.43e-08),
    ("bump", 9, 16384, 5.47e-08, 7.82e-07, 1.11e-07),
    ("bump", 10, 16384, 5.47e-08, 7.64e-07, 1.23e-07),
    ("bump", 11, 16384, 1e-15, 1e-14, 1.47e-07),
    ("bump", 3, 16384, 8.31e-08, 7.82e-07, 9.37e-07),
    ("bump", 12, 16384, 5.63e-08, 7.82e-07, 1.13e-06),
    ("bump", 13, 16384, 1e-15, 1e-14, 1.99e-06),
    ("bump", 14, 16384, 5.47e-08, 7.82e-07, 4.58e-06),
    ("rough", 15, 1, 3.3e-08, 7.44e-07, 2.99e-05),
    ("rough", 16, 1, 3.68e-12, 4.08e-12, 4.3e-05),
    ("rough", 17, 1, 3.3e-08, 7.44e-07, 0.000162),
    ("rough", 18, 1, 3.68e-12, 4.08e-12, 0.000165),
    ("rough", 19, 16384, 3.45e-06, 1.95e-05, 1.11e-07),
    ("rough", 20, 16384, 5.22e-07, 1.98e-05, 1.11e-07),
    ("rough", 10, 16384, 3.4e-08, 7.53e-07, 1.12e-07),
    ("rough", 9, 16384, 3.4e-08, 7.44e-07, 1.15e-07),
    ("rough", 15, 16384, 3.3e-08, 7.44e-07, 1.33e-07),
    ("rough", 21, 16384, 3.79e-09, 4.03e-09, 1.81e-07),
    ("rough", 16, 16384, 3.68e-12, 4.08e-12, 2.3e-07),
    ("rough", 17, 16384, 3.3e-08, 7.44e-07, 3.95e-06),
    ("rough", 18, 16384, 3.68e-12, 4.08e-12, 5.19e-06),
    ("rough", 0, 16384, 1e-15, 1e-14, 1.18e-05),
)
"""Track, index of the setting, poses at once, error of the torque over weight times
radius [-], of the rear contact [m], processor seconds for each pose."""
