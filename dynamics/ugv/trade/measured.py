"""Measured settings, out of `python -m benchmarks.ugv --update`: not by hand.

Without a wrong status in their sample, and not beaten by one of the same precision and checks in
cost and in both promised errors.
"""

from __future__ import annotations

from stickslip.dynamics.ugv.pose_solver import PoseSolver

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit 47b88b1, 2026-11-22"
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
    (PoseSolver(tolerance=0.0001, samples=0), "float64", 32),
    (PoseSolver(tolerance=0.0001, samples=0), "float32", 32),
    (PoseSolver(), "float64", 64),
    (PoseSolver(samples=0), "float64", 64),
    (PoseSolver(tolerance=0.0001, samples=0), "float32", 64),
    (PoseSolver(), "float32", 32),
    (PoseSolver(samples=0), "float32", 32),
)
"""Solver, dtype, pieces of a table for the shortest wave."""

PROMISES = (
    ("closed", "near", 0, 16222, (1e-15, 3.33e-15, 1.09e-14), (1e-15, 1.73e-14, 2.22e-14)),
    ("closed", "near", 1, 16222, (6.61e-09, 1.37e-06, 6.36e-06), (4.04e-07, 9.06e-06, 1.84e-05)),
    ("closed", "near", 2, 16222, (1e-15, 3.33e-15, 1.09e-14), (1e-15, 1.73e-14, 2.22e-14)),
    ("closed", "near", 3, 16222, (6.61e-09, 1.37e-06, 6.36e-06), (4.04e-07, 9.06e-06, 1.84e-05)),
    ("closed", "near", 4, 16222, (1e-15, 1.21e-07, 4.67e-06), (4.24e-15, 8.5e-07, 1.45e-05)),
    ("closed", "near", 5, 16222, (6.64e-09, 1.48e-06, 6.36e-06), (4.08e-07, 9.76e-06, 1.84e-05)),
    ("closed", "far", 0, 16211, (1e-15, 3.85e-13, 2.22e-12), (1e-15, 2.77e-12, 7.65e-12)),
    ("closed", "far", 1, 16211, (1.57e-07, 0.000285, 0.00407), (2.87e-05, 0.00188, 0.0194)),
    ("closed", "far", 2, 16211, (1e-15, 3.85e-13, 2.22e-12), (1e-15, 2.77e-12, 7.65e-12)),
    ("closed", "far", 3, 16211, (1.57e-07, 0.000285, 0.00407), (2.87e-05, 0.00188, 0.0194)),
    ("closed", "far", 4, 16211, (1e-15, 1.51e-07, 2.94e-05), (1e-15, 1.01e-06, 0.000133)),
    ("closed", "far", 5, 16211, (1.56e-07, 0.000285, 0.00407), (2.87e-05, 0.00188, 0.0194)),
    ("waves", "near", 0, 16373, (1e-15, 2.92e-15, 1.02e-14), (1e-15, 1.89e-14, 3.37e-14)),
    ("waves", "near", 2, 16373, (1e-15, 2.92e-15, 1.02e-14), (1e-15, 1.89e-14, 3.37e-14)),
    ("waves", "near", 6, 16373, (9.96e-09, 7.63e-07, 3.78e-06), (3.51e-07, 9.05e-06, 1.77e-05)),
    ("waves", "near", 7, 16373, (9.96e-09, 7.63e-07, 3.78e-06), (3.51e-07, 9.05e-06, 1.77e-05)),
    ("waves", "near", 8, 16373, (9.55e-11, 1.11e-08, 4e-07), (4.82e-10, 1.86e-07, 1.59e-06)),
    ("waves", "near", 9, 16373, (8.08e-09, 7.97e-07, 3.74e-06), (3.5e-07, 8.84e-06, 1.57e-05)),
    ("waves", "near", 10, 16373, (2.87e-12, 1.29e-10, 2.41e-10), (1.28e-11, 4.14e-10, 7.62e-10)),
    ("waves", "near", 11, 16373, (2.87e-12, 1.29e-10, 2.41e-10), (1.28e-11, 4.14e-10, 7.62e-10)),
    ("waves", "near", 12, 16373, (8.07e-09, 7.97e-07, 3.59e-06), (3.5e-07, 8.84e-06, 1.57e-05)),
    ("waves", "far", 0, 16375, (1.32e-15, 5e-13, 9.14e-13), (1e-15, 3.21e-12, 4.05e-12)),
    ("waves", "far", 2, 16375, (1.32e-15, 5e-13, 9.14e-13), (1e-15, 3.21e-12, 4.05e-12)),
    ("waves", "far", 13, 16375, (2.9e-07, 0.000122, 0.000294), (2.75e-05, 0.00167, 0.002)),
    ("waves", "far", 14, 16375, (2.9e-07, 0.000122, 0.000294), (2.75e-05, 0.00167, 0.002)),
    ("waves", "far", 8, 16375, (9.4e-11, 2.24e-08, 8.35e-06), (4.97e-10, 2.01e-07, 3.76e-05)),
    ("waves", "far", 10, 16375, (2.84e-12, 1.6e-10, 6.93e-10), (1.27e-11, 4.73e-10, 2e-09)),
    ("waves", "far", 11, 16375, (2.84e-12, 1.6e-10, 6.93e-10), (1.27e-11, 4.73e-10, 2e-09)),
    ("spline", "near", 0, 16229, (1e-15, 3.59e-15, 1.26e-14), (1e-15, 1.83e-14, 2.32e-14)),
    ("spline", "near", 1, 16229, (7.26e-09, 9.45e-07, 2.71e-06), (3.43e-07, 9.11e-06, 1.85e-05)),
    ("spline", "near", 2, 16229, (1e-15, 3.59e-15, 1.26e-14), (1e-15, 1.83e-14, 2.32e-14)),
    ("spline", "near", 3, 16229, (7.26e-09, 9.45e-07, 2.71e-06), (3.43e-07, 9.11e-06, 1.85e-05)),
    ("spline", "near", 4, 16229, (8.06e-15, 6.47e-08, 1.05e-06), (7.59e-13, 6.8e-07, 2.93e-05)),
    ("spline", "far", 0, 16247, (1e-15, 4.73e-14, 2.69e-13), (1e-15, 2.79e-13, 2.04e-12)),
    ("spline", "far", 1, 16247, (2.85e-07, 0.000162, 0.00064), (2.79e-05, 0.00173, 0.00275)),
    ("spline", "far", 2, 16247, (1e-15, 4.73e-14, 2.69e-13), (1e-15, 2.79e-13, 2.04e-12)),
    ("spline", "far", 3, 16247, (2.85e-07, 0.000162, 0.00064), (2.79e-05, 0.00173, 0.00275)),
    ("spline", "far", 4, 16247, (9.57e-15, 1.3e-07, 1.63e-06), (1.05e-12, 7.23e-07, 7.48e-06)),
    ("function", "near", 0, 32592, (1e-15, 5.06e-15, 3.27e-14), (1e-15, 2.02e-14, 1.02e-13)),
    ("function", "near", 2, 32592, (1e-15, 5.06e-15, 3.27e-14), (1e-15, 2.02e-14, 1.02e-13)),
    ("function", "near", 3, 32592, (1.56e-08, 1.71e-06, 3.74e-06), (4.01e-07, 1.03e-05, 3.84e-05)),
    ("function", "far", 0, 32615, (1.41e-15, 6.32e-13, 1.84e-12), (1e-15, 3.67e-12, 6.15e-12)),
    ("function", "far", 2, 32615, (1.41e-15, 6.32e-13, 1.84e-12), (1e-15, 3.67e-12, 6.15e-12)),
    ("function", "far", 3, 32615, (7.69e-07, 0.000339, 0.00102), (2.87e-05, 0.00195, 0.00419)),
)
"""Ground, place, index of the setting, poses in the sample; typical, promised, worst
error of the torque over weight times radius [-], of the rear contact in radii."""

COSTS = (
    ("closed", 0, 1, 5.81e-05),
    ("closed", 0, 16384, 2.84e-07),
    ("closed", 1, 1, 6.44e-05),
    ("closed", 1, 16384, 1.05e-07),
    ("closed", 2, 1, 2.25e-05),
    ("closed", 2, 16384, 1.56e-07),
    ("closed", 3, 1, 2.29e-05),
    ("closed", 3, 16384, 6.85e-08),
    ("closed", 4, 16384, 1.35e-07),
    ("closed", 5, 16384, 6.34e-08),
    ("function", 0, 1, 8.88e-05),
    ("function", 0, 16384, 7.06e-06),
    ("function", 2, 1, 2.24e-05),
    ("function", 2, 16384, 1.71e-06),
    ("function", 3, 1, 2.15e-05),
    ("function", 3, 16384, 6.91e-07),
    ("spline", 0, 1, 9.56e-05),
    ("spline", 0, 16384, 3.91e-07),
    ("spline", 1, 1, 0.000108),
    ("spline", 1, 16384, 3.27e-07),
    ("spline", 2, 1, 2.21e-05),
    ("spline", 2, 16384, 1.49e-07),
    ("spline", 3, 1, 2.27e-05),
    ("spline", 3, 16384, 9.64e-08),
    ("spline", 4, 16384, 1.35e-07),
    ("waves", 0, 1, 0.000192),
    ("waves", 0, 16384, 4.2e-05),
    ("waves", 2, 1, 0.000122),
    ("waves", 2, 16384, 1.2e-05),
    ("waves", 6, 1, 0.000108),
    ("waves", 6, 16384, 3.27e-07),
    ("waves", 7, 1, 2.27e-05),
    ("waves", 7, 16384, 9.64e-08),
    ("waves", 8, 16384, 1.35e-07),
    ("waves", 9, 16384, 1.02e-07),
    ("waves", 10, 1, 9.56e-05),
    ("waves", 10, 16384, 3.91e-07),
    ("waves", 11, 1, 2.21e-05),
    ("waves", 11, 16384, 1.49e-07),
    ("waves", 12, 16384, 1.02e-07),
    ("waves", 13, 1, 0.000108),
    ("waves", 13, 16384, 3.27e-07),
    ("waves", 14, 1, 2.27e-05),
    ("waves", 14, 16384, 9.64e-08),
)
"""Ground, index of the setting, poses at once, processor seconds for each pose."""
