"""Measured settings, out of `python -m benchmarks.tradeoff --update`: not by hand.

Points that no other of the same precision beats in cost and in both errors.
"""

from __future__ import annotations

from stickslip.dynamics.biped.integrators import RK4Split
from stickslip.dynamics.biped.table import Table

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit d4df94b, 2026-11-21"
"""Processor, versions, commit and day."""

SETTINGS = (
    (Table(pieces=32, degree=7), RK4Split(), 0.02, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.02, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.005, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.005, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.00125, "float64"),
)
"""Fidelity, integrator, dt [s], dtype."""

ROWS = (
    ("smooth", 0, 1, 4.17e-05, 0, 0.000868),
    ("smooth", 1, 1, 4.13e-05, 0, 0.000978),
    ("smooth", 2, 1, 2.35e-06, 0, 0.00168),
    ("smooth", 3, 1, 1.82e-07, 0, 0.00179),
    ("smooth", 4, 1, 7.27e-10, 0, 0.00577),
    ("smooth", 1, 4096, 4.13e-05, 0, 8.56e-06),
    ("smooth", 0, 4096, 4.17e-05, 0, 8.78e-06),
    ("smooth", 2, 4096, 2.35e-06, 0, 2.65e-05),
    ("smooth", 3, 4096, 1.82e-07, 0, 2.71e-05),
    ("smooth", 4, 4096, 7.27e-10, 0, 9.56e-05),
    ("stick-slip", 1, 1, 0.000964, 0.000217, 0.00109),
    ("stick-slip", 0, 1, 0.000964, 0.000217, 0.00113),
    ("stick-slip", 3, 1, 3.23e-06, 6.47e-07, 0.00307),
    ("stick-slip", 2, 1, 4.54e-06, 6.55e-07, 0.00613),
    ("stick-slip", 4, 1, 1.32e-08, 2.38e-09, 0.0105),
    ("stick-slip", 0, 4096, 0.000964, 0.000217, 1.32e-05),
    ("stick-slip", 1, 4096, 0.000964, 0.000217, 1.51e-05),
    ("stick-slip", 2, 4096, 4.54e-06, 6.55e-07, 4.81e-05),
    ("stick-slip", 3, 4096, 3.23e-06, 6.47e-07, 6.66e-05),
    ("stick-slip", 4, 4096, 1.32e-08, 2.38e-09, 0.00023),
    ("ice", 0, 1, 0.000218, 8.51e-06, 0.000974),
    ("ice", 2, 1, 3.67e-06, 6.08e-08, 0.00305),
    ("ice", 0, 4096, 0.000218, 8.51e-06, 2.32e-05),
    ("ice", 2, 4096, 3.67e-06, 6.08e-08, 6.03e-05),
)
"""Scene, index of the setting, environments, error of the crank angle [rad/s], of
the slide [m/s], seconds for each simulated second and environment."""
