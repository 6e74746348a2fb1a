"""Measured settings, out of `python -m benchmarks.ugv --update`: not by hand.

Points that none of the same precision and checks beats in cost and in both errors.
"""

from __future__ import annotations

from stickslip.dynamics.ugv.pose_solver import PoseSolver

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit 5ff7edd, 2026-11-21"
"""Processor, versions, commit and day."""

SETTINGS = (
    (PoseSolver(samples=0), "float32", None),
    (PoseSolver(samples=0), "float64", None),
    (PoseSolver(samples=0), "float32", 8),
    (PoseSolver(), "float32", None),
    (PoseSolver(), "float64", None),
    (PoseSolver(), "float32", 8),
    (PoseSolver(iterations=1, samples=0), "float32", None),
    (PoseSolver(iterations=2, samples=0), "float32", None),
    (PoseSolver(iterations=3, samples=0), "float32", None),
    (PoseSolver(iterations=3, samples=0), "float32", 16),
    (PoseSolver(iterations=4, samples=0), "float32", 16),
    (PoseSolver(tolerance=0.01, samples=0), "float64", None),
    (PoseSolver(iterations=2, samples=0), "float64", None),
    (PoseSolver(iterations=3), "float32", None),
    (PoseSolver(iterations=3), "float64", None),
    (PoseSolver(iterations=3), "float32", 16),
    (PoseSolver(samples=0), "float64", 64),
    (PoseSolver(samples=0), "float32", 32),
    (PoseSolver(), "float32", 32),
    (PoseSolver(), "float64", 64),
    (PoseSolver(iterations=1, samples=0), "float32", 16),
    (PoseSolver(tolerance=0.01, samples=0), "float64", 4),
    (PoseSolver(tolerance=0.01, samples=0), "float64", 16),
    (PoseSolver(iterations=2, samples=0), "float64", 16),
    (PoseSolver(iterations=3), "float64", 16),
)
"""Solver, dtype, pieces of a table for each metre."""

ROWS = (
    ("bump", 0, 1, 8.31e-08, 7.82e-07, 2.62e-05),
    ("bump", 1, 1, 1e-15, 1e-14, 2.63e-05),
    ("bump", 2, 1, 5.79e-08, 7.82e-07, 2.66e-05),
    ("bump", 3, 1, 8.31e-08, 7.82e-07, 7.53e-05),
    ("bump", 4, 1, 1e-15, 1e-14, 7.98e-05),
    ("bump", 5, 1, 5.79e-08, 7.82e-07, 0.00015),
    ("bump", 6, 16384, 5.82e-08, 7.82e-07, 5.98e-08),
    ("bump", 7, 16384, 8.31e-08, 7.64e-07, 6.52e-08),
    ("bump", 8, 16384, 5.63e-08, 7.82e-07, 6.81e-08),
    ("bump", 9, 16384, 5.47e-08, 7.82e-07, 9.43e-08),
    ("bump", 10, 16384, 5.47e-08, 7.64e-07, 1.01e-07),
    ("bump", 11, 16384, 4.59e-06, 8.83e-05, 1.24e-07),
    ("bump", 12, 16384, 1e-15, 1e-14, 1.27e-07),
    ("bump", 13, 16384, 5.63e-08, 7.82e-07, 6.57e-07),
    ("bump", 14, 16384, 1e-15, 1e-14, 9.73e-07),
    ("bump", 15, 16384, 5.47e-08, 7.82e-07, 1.38e-06),
    ("rough", 16, 1, 3.68e-12, 4.08e-12, 2.7e-05),
    ("rough", 17, 1, 3.3e-08, 7.44e-07, 2.7e-05),
    ("rough", 18, 1, 3.3e-08, 7.44e-07, 0.000149),
    ("rough", 19, 1, 3.68e-12, 4.08e-12, 0.000209),
    ("rough", 20, 16384, 3.4e-08, 7.44e-07, 7.86e-08),
    ("rough", 17, 16384, 3.3e-08, 7.44e-07, 1.01e-07),
    ("rough", 21, 16384, 3.45e-06, 1.96e-05, 1.54e-07),
    ("rough", 22, 16384, 5.35e-07, 1.98e-05, 1.54e-07),
    ("rough", 23, 16384, 3.79e-09, 4.03e-09, 1.58e-07),
    ("rough", 16, 16384, 3.68e-12, 4.08e-12, 1.91e-07),
    ("rough", 18, 16384, 3.3e-08, 7.44e-07, 1.38e-06),
    ("rough", 24, 16384, 3.79e-09, 4.03e-09, 1.96e-06),
    ("rough", 19, 16384, 3.68e-12, 4.08e-12, 2.01e-06),
    ("rough", 1, 16384, 1e-15, 1e-14, 1.1e-05),
)
"""Track, index of the setting, poses at once, error of the torque over weight times
radius [-], of the rear contact [m], processor seconds for each pose."""
