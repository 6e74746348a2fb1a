"""Measured settings, out of `python -m benchmarks.tradeoff --update`: not by hand.

Points that no other of the same precision beats in cost and in both errors.
"""

from __future__ import annotations

from stickslip.dynamics.biped.integrators import RK4Split
from stickslip.dynamics.biped.table import Table

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit 1180e2f, 2026-11-21"
"""Processor, versions, commit and day."""

SETTINGS = (
    (Table(pieces=32, degree=7), RK4Split(), 0.02, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.02, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.005, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.005, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.00125, "float64"),
)
"""Fidelity, integrator, dt [s], dtype."""

ROWS = (
    ("smooth", 0, 1, 4.17e-05, 0, 0.000341),
    ("smooth", 1, 1, 4.13e-05, 0, 0.000876),
    ("smooth", 2, 1, 1.82e-07, 0, 0.00148),
    ("smooth", 3, 1, 2.35e-06, 0, 0.004),
    ("smooth", 4, 1, 7.27e-10, 0, 0.0288),
    ("smooth", 0, 4096, 4.17e-05, 0, 3.41e-05),
    ("smooth", 1, 4096, 4.13e-05, 0, 3.81e-05),
    ("smooth", 3, 4096, 2.35e-06, 0, 9.8e-05),
    ("smooth", 2, 4096, 1.82e-07, 0, 0.000102),
    ("smooth", 4, 4096, 7.27e-10, 0, 0.000388),
    ("stick-slip", 1, 1, 0.000964, 0.000217, 0.000874),
    ("stick-slip", 0, 1, 0.000964, 0.000217, 0.000881),
    ("stick-slip", 3, 1, 4.54e-06, 6.55e-07, 0.00285),
    ("stick-slip", 2, 1, 3.23e-06, 6.47e-07, 0.0152),
    ("stick-slip", 4, 1, 1.32e-08, 2.38e-09, 0.0248),
    ("stick-slip", 0, 4096, 0.000964, 0.000217, 8.11e-05),
    ("stick-slip", 1, 4096, 0.000964, 0.000217, 0.000227),
    ("stick-slip", 3, 4096, 4.54e-06, 6.55e-07, 0.000239),
    ("stick-slip", 2, 4096, 3.23e-06, 6.47e-07, 0.000586),
    ("stick-slip", 4, 4096, 1.32e-08, 2.38e-09, 0.00212),
    ("ice", 0, 1, 0.000218, 8.51e-06, 0.0017),
    ("ice", 3, 1, 3.67e-06, 6.08e-08, 0.00492),
    ("ice", 0, 4096, 0.000218, 8.51e-06, 0.000122),
    ("ice", 3, 4096, 3.67e-06, 6.08e-08, 0.000373),
)
"""Scene, index of the setting, environments, error of the crank angle [rad/s], of
the slide [m/s], wall seconds for each simulated second and environment."""
