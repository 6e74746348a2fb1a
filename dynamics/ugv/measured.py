"""Measured settings, out of `python -m benchmarks.ugv --update`: not by hand.

Without a wrong status in their sample, and not beaten by one of the same precision and checks in
cost and in both promised errors.
"""

from __future__ import annotations

from stickslip.dynamics.ugv.pose_solver import PoseSolver

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit 677bd1c, 2026-11-22"
"""Processor, versions, commit and day."""

QUANTILE, CONFIDENCE = 0.999, 0.95
"""Of the promised errors."""

GROUNDS = {
    "closed": "bumps, sinusoids, ramps, steps and ditches",
    "waves": "sums of 1 to 16 waves, half with the spectrum of ISO 8608",
    "spline": "cubic, pchip and makima splines through points, and tables of waves",
    "function": "closed forms and sums of waves",
}
PLACES = {
    "near": "0 to 100 wheel radii from the origin",
    "far": "100 to 20000 wheel radii from the origin",
}
EVERYWHERE = "slopes to 0.9, 20% up to 6 times hollower than the wheel"
VEHICLES = "wheels of 0.1 to 1 m, bodies of 2 to 5 and legs of 0.8 to 1.8 wheel radii"
"""The population."""

SETTINGS = (
    (PoseSolver(), "float64", None),
    (PoseSolver(), "float32", None),
    (PoseSolver(samples=0), "float64", None),
    (PoseSolver(samples=0), "float32", None),
    (PoseSolver(tolerance=0.0001, samples=0), "float64", None),
    (PoseSolver(tolerance=0.0001, samples=0), "float32", None),
    (PoseSolver(), "float32", 16),
    (PoseSolver(samples=0), "float32", 16),
    (PoseSolver(tolerance=0.0001, samples=0), "float32", 16),
    (PoseSolver(tolerance=0.0001, samples=0), "float64", 32),
    (PoseSolver(tolerance=0.0001, samples=0), "float32", 32),
    (PoseSolver(), "float64", 64),
    (PoseSolver(samples=0), "float64", 64),
    (PoseSolver(tolerance=0.0001, samples=0), "float64", 64),
    (PoseSolver(), "float32", 8),
    (PoseSolver(samples=0), "float32", 8),
)
"""Solver, dtype, pieces of a table for the shortest wave."""

PROMISES = (
    ("closed", "near", 0, 16222, (1e-15, 5.14e-15, 1.81e-14), (1e-15, 1.99e-14, 3.2e-14)),
    ("closed", "near", 1, 16222, (8.18e-09, 3.13e-06, 1.27e-05), (4.5e-07, 1.27e-05, 1.84e-05)),
    ("closed", "near", 2, 16222, (1e-15, 5.14e-15, 1.81e-14), (1e-15, 1.99e-14, 3.2e-14)),
    ("closed", "near", 3, 16222, (8.18e-09, 3.13e-06, 1.27e-05), (4.5e-07, 1.27e-05, 1.84e-05)),
    ("closed", "near", 4, 16222, (1e-15, 6.23e-06, 5.35e-05), (2.69e-14, 5.02e-05, 0.000319)),
    ("closed", "near", 5, 16222, (8.48e-09, 6.64e-06, 5.39e-05), (4.56e-07, 5.55e-05, 0.000316)),
    ("closed", "far", 0, 16211, (1e-15, 8.8e-13, 8.89e-12), (1e-15, 3.75e-12, 4.33e-11)),
    ("closed", "far", 1, 16210, (3.35e-07, 0.000622, 0.00348), (3.44e-05, 0.00242, 0.0166)),
    ("closed", "far", 2, 16211, (1e-15, 8.8e-13, 8.89e-12), (1e-15, 3.75e-12, 4.33e-11)),
    ("closed", "far", 3, 16210, (3.35e-07, 0.000622, 0.00348), (3.44e-05, 0.00242, 0.0166)),
    ("waves", "near", 0, 16373, (1e-15, 3.58e-15, 2.91e-14), (1e-15, 2.11e-14, 4.69e-14)),
    ("waves", "near", 2, 16373, (1e-15, 3.58e-15, 2.91e-14), (1e-15, 2.11e-14, 4.69e-14)),
    ("waves", "near", 6, 16373, (1.24e-08, 1.35e-06, 3.84e-06), (4e-07, 1.18e-05, 1.77e-05)),
    ("waves", "near", 7, 16373, (1.24e-08, 1.35e-06, 3.84e-06), (4e-07, 1.18e-05, 1.77e-05)),
    ("waves", "near", 8, 16373, (1.26e-08, 1.86e-06, 6.09e-06), (4.04e-07, 1.57e-05, 7.56e-05)),
    ("waves", "near", 9, 16373, (1.11e-10, 8.95e-07, 5.86e-06), (6.19e-10, 1.23e-05, 6.99e-05)),
    ("waves", "near", 10, 16373, (1.08e-08, 1.81e-06, 6.49e-06), (3.98e-07, 1.69e-05, 7.56e-05)),
    ("waves", "near", 11, 16373, (2.87e-12, 1.29e-10, 2.41e-10), (1.28e-11, 4.14e-10, 7.62e-10)),
    ("waves", "near", 12, 16373, (2.87e-12, 1.29e-10, 2.41e-10), (1.28e-11, 4.14e-10, 7.62e-10)),
    ("waves", "near", 13, 16373, (4.89e-12, 8.96e-07, 5.86e-06), (3.45e-11, 1.23e-05, 6.99e-05)),
    ("waves", "far", 0, 16375, (1.68e-15, 7.1e-13, 1.83e-12), (1e-15, 3.88e-12, 6.12e-12)),
    ("waves", "far", 2, 16375, (1.68e-15, 7.1e-13, 1.83e-12), (1e-15, 3.88e-12, 6.12e-12)),
    ("waves", "far", 14, 16375, (7.73e-07, 0.000253, 0.000826), (3.74e-05, 0.00244, 0.00373)),
    ("waves", "far", 15, 16375, (7.73e-07, 0.000253, 0.000826), (3.74e-05, 0.00244, 0.00373)),
    ("waves", "far", 11, 16375, (2.85e-12, 1.6e-10, 6.94e-10), (1.28e-11, 4.73e-10, 2e-09)),
    ("waves", "far", 12, 16375, (2.85e-12, 1.6e-10, 6.94e-10), (1.28e-11, 4.73e-10, 2e-09)),
    ("spline", "near", 0, 16229, (1e-15, 4.18e-15, 1.29e-14), (1e-15, 2.03e-14, 3.08e-14)),
    ("spline", "near", 1, 16229, (1.04e-08, 1.82e-06, 3.72e-06), (4.07e-07, 1.21e-05, 2.2e-05)),
    ("spline", "near", 2, 16229, (1e-15, 4.18e-15, 1.29e-14), (1e-15, 2.03e-14, 3.08e-14)),
    ("spline", "near", 3, 16229, (1.04e-08, 1.82e-06, 3.72e-06), (4.07e-07, 1.21e-05, 2.2e-05)),
    ("spline", "near", 4, 16229, (1.14e-13, 6.55e-06, 0.000517), (1.09e-11, 6.86e-05, 0.0039)),
    ("spline", "near", 5, 16229, (1.06e-08, 7.19e-06, 0.000517), (4.07e-07, 6.97e-05, 0.0039)),
    ("spline", "far", 0, 16247, (1e-15, 2.25e-13, 9.47e-13), (1e-15, 5.34e-13, 2.37e-12)),
    ("spline", "far", 1, 16247, (7.12e-07, 0.000422, 0.00108), (3.81e-05, 0.00244, 0.00279)),
    ("spline", "far", 2, 16247, (1e-15, 2.25e-13, 9.47e-13), (1e-15, 5.34e-13, 2.37e-12)),
    ("spline", "far", 3, 16247, (7.12e-07, 0.000422, 0.00108), (3.81e-05, 0.00244, 0.00279)),
    ("function", "near", 0, 32595, (1e-15, 5.14e-15, 2.91e-14), (1e-15, 2.11e-14, 4.69e-14)),
    ("function", "near", 1, 32595, (1.75e-08, 3.13e-06, 1.27e-05), (4.5e-07, 1.45e-05, 3.58e-05)),
    ("function", "near", 2, 32595, (1e-15, 5.14e-15, 2.91e-14), (1e-15, 2.11e-14, 4.69e-14)),
    ("function", "near", 3, 32595, (1.75e-08, 3.13e-06, 1.27e-05), (4.5e-07, 1.45e-05, 3.58e-05)),
    ("function", "far", 0, 32586, (1.68e-15, 8.8e-13, 8.89e-12), (1e-15, 3.88e-12, 4.33e-11)),
    ("function", "far", 2, 32586, (1.68e-15, 8.8e-13, 8.89e-12), (1e-15, 3.88e-12, 4.33e-11)),
)
"""Ground, place, index of the setting, poses in the sample; typical, promised, worst
error of the torque over weight times radius [-], of the rear contact in radii."""

COSTS = (
    ("closed", 0, 1, 7.98e-05),
    ("closed", 0, 16384, 9.81e-07),
    ("closed", 1, 1, 7.53e-05),
    ("closed", 1, 16384, 6.94e-07),
    ("closed", 2, 1, 2.63e-05),
    ("closed", 2, 16384, 1.53e-07),
    ("closed", 3, 1, 2.62e-05),
    ("closed", 3, 16384, 7.8e-08),
    ("closed", 4, 16384, 1.36e-07),
    ("closed", 5, 16384, 6.98e-08),
    ("function", 0, 1, 0.000255),
    ("function", 0, 16384, 2.16e-05),
    ("function", 1, 1, 0.000262),
    ("function", 1, 16384, 1.19e-05),
    ("function", 2, 1, 6.88e-05),
    ("function", 2, 16384, 1.96e-06),
    ("function", 3, 1, 7.89e-05),
    ("function", 3, 16384, 7.04e-07),
    ("spline", 0, 1, 0.000209),
    ("spline", 0, 16384, 2.01e-06),
    ("spline", 1, 1, 0.000149),
    ("spline", 1, 16384, 1.38e-06),
    ("spline", 2, 1, 2.7e-05),
    ("spline", 2, 16384, 1.91e-07),
    ("spline", 3, 1, 2.7e-05),
    ("spline", 3, 16384, 1.01e-07),
    ("spline", 4, 16384, 1.66e-07),
    ("spline", 5, 16384, 8.94e-08),
    ("waves", 0, 1, 0.000667),
    ("waves", 0, 16384, 0.000217),
    ("waves", 2, 1, 0.000503),
    ("waves", 2, 16384, 2.08e-05),
    ("waves", 6, 1, 0.000149),
    ("waves", 6, 16384, 1.38e-06),
    ("waves", 7, 1, 2.7e-05),
    ("waves", 7, 16384, 1.01e-07),
    ("waves", 8, 16384, 8.94e-08),
    ("waves", 9, 16384, 1.66e-07),
    ("waves", 10, 16384, 8.94e-08),
    ("waves", 11, 1, 0.000209),
    ("waves", 11, 16384, 2.01e-06),
    ("waves", 12, 1, 2.7e-05),
    ("waves", 12, 16384, 1.91e-07),
    ("waves", 13, 16384, 1.66e-07),
    ("waves", 14, 1, 0.000149),
    ("waves", 14, 16384, 1.38e-06),
    ("waves", 15, 1, 2.7e-05),
    ("waves", 15, 16384, 1.01e-07),
)
"""Ground, index of the setting, poses at once, processor seconds for each pose."""
