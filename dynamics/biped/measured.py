"""Measured settings, out of `python -m benchmarks.tradeoff --update`: not by hand."""

# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from stickslip.dynamics.biped.integrators import EventExact, RK4Split
from stickslip.dynamics.biped.table import Table

MEASURED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit a6205f3, 2026-11-22"
"""Where the costs come from: processor, versions, commit and day."""

SAMPLED_ON = "AMD EPYC, 2 cores, jax 0.10.2, commit a6205f3, 2026-11-22"
"""Where the errors come from."""

INF = float("inf")

SETTINGS = (
    (Table(pieces=8, degree=4), RK4Split(), 0.01, "float32"),
    (Table(pieces=8, degree=4), RK4Split(), 0.02, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.02, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.02, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.01, "float32"),
    (Table(pieces=32, degree=7), EventExact(rtol=0.0001, atol=1e-07), 0.02, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.005, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.01, "float64"),
    (Table(pieces=32, degree=7), EventExact(rtol=1e-07, atol=1e-10), 0.02, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.005, "float64"),
    (Table(pieces=64, degree=9), EventExact(rtol=1e-10, atol=1e-13), 0.02, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.0025, "float64"),
    (Table(pieces=32, degree=7), RK4Split(), 0.0025, "float32"),
    (Table(pieces=32, degree=7), RK4Split(), 0.00125, "float64"),
    (Table(pieces=64, degree=9), RK4Split(), 0.00125, "float64"),
    (Table(pieces=64, degree=9), RK4Split(), 0.0003125, "float64"),
)
"""Fidelity, integrator, dt of the default robot [s], dtype."""

COSTS = (
    ("smooth", 0, 1, 0.000401),
    ("smooth", 1, 1, 0.000471),
    ("smooth", 2, 1, 0.000532),
    ("smooth", 3, 1, 0.000568),
    ("smooth", 4, 1, 0.000715),
    ("smooth", 5, 1, 0.000969),
    ("smooth", 6, 1, 0.00125),
    ("smooth", 7, 1, 0.00133),
    ("smooth", 8, 1, 0.00149),
    ("smooth", 9, 1, 0.00205),
    ("smooth", 10, 1, 0.0026),
    ("smooth", 11, 1, 0.00327),
    ("smooth", 12, 1, 0.00414),
    ("smooth", 13, 1, 0.00605),
    ("smooth", 14, 1, 0.00889),
    ("smooth", 15, 1, 0.0232),
    ("smooth", 0, 4096, 9.51e-06),
    ("smooth", 1, 4096, 1.07e-05),
    ("smooth", 3, 4096, 1.18e-05),
    ("smooth", 2, 4096, 1.25e-05),
    ("smooth", 4, 4096, 1.46e-05),
    ("smooth", 7, 4096, 1.56e-05),
    ("smooth", 6, 4096, 2.89e-05),
    ("smooth", 9, 4096, 3.28e-05),
    ("smooth", 12, 4096, 4.58e-05),
    ("smooth", 11, 4096, 7.03e-05),
    ("smooth", 5, 4096, 0.000111),
    ("smooth", 13, 4096, 0.000119),
    ("smooth", 8, 4096, 0.000161),
    ("smooth", 14, 4096, 0.000207),
    ("smooth", 10, 4096, 0.000248),
    ("smooth", 15, 4096, 0.000793),
    ("stick-slip", 1, 1, 0.000691),
    ("stick-slip", 0, 1, 0.00108),
    ("stick-slip", 2, 1, 0.00178),
    ("stick-slip", 4, 1, 0.0025),
    ("stick-slip", 5, 1, 0.00325),
    ("stick-slip", 8, 1, 0.00655),
    ("stick-slip", 10, 1, 0.0132),
    ("stick-slip", 2, 4096, 1.39e-05),
    ("stick-slip", 1, 4096, 1.9e-05),
    ("stick-slip", 4, 4096, 2.55e-05),
    ("stick-slip", 0, 4096, 3.1e-05),
    ("stick-slip", 5, 4096, 0.000224),
    ("stick-slip", 8, 4096, 0.000407),
    ("stick-slip", 10, 4096, 0.00111),
    ("ice", 10, 1, 0.0149),
    ("ice", 10, 4096, 0.00158),
)
"""Scene, index of the setting, environments, seconds for each simulated second and
environment."""

SAMPLES = {
    ("smooth", "default"): (512, 0),
    ("smooth", "others"): (511, 0.0156),
    ("stick-slip", "default"): (485, 0.0156),
    ("stick-slip", "others"): (475, 0.0156),
    ("ice", "default"): (487, 0),
    ("ice", "others"): (483, 0.0156),
}
"""By scene and robots: how many walks, and the share of sensitive ones."""

ERRORS = {
    ("smooth", 0, "default"): (((0.000616, 0.000616, 0), (0.0302, 0.0302, 0), (0.0582, 0.0582, 0)), 0.0059),
    ("smooth", 1, "default"): (((0.000682, 0.000682, 0), (0.144, 0.144, 0), (0.438, 0.438, 0)), 0.0059),
    ("smooth", 2, "default"): (((5.57e-05, 5.57e-05, 0), (0.12, 0.12, 0), (0.294, 0.294, 0)), 0.0059),
    ("smooth", 3, "default"): (((5.4e-05, 5.4e-05, 0), (0.12, 0.12, 0), (0.294, 0.294, 0)), 0.0059),
    ("smooth", 4, "default"): (((5.85e-06, 5.85e-06, 0), (0.0126, 0.0126, 0), (0.0378, 0.0378, 0)), 0.0059),
    ("smooth", 5, "default"): (((1.03e-07, 1.03e-07, 0), (9.39e-05, 9.39e-05, 0), (0.000183, 0.000183, 0)), 0.0059),
    ("smooth", 6, "default"): (((2.73e-06, 2.73e-06, 0), (0.000862, 0.000862, 0), (0.00292, 0.00292, 0)), 0),
    ("smooth", 7, "default"): (((4.21e-06, 4.21e-06, 0), (0.0126, 0.0126, 0), (0.0378, 0.0378, 0)), 0.0059),
    ("smooth", 8, "default"): (((1.45e-08, 1.45e-08, 0), (4.41e-06, 4.41e-06, 0), (1.34e-05, 1.34e-05, 0)), 0.002),
    ("smooth", 9, "default"): (((2.78e-07, 2.78e-07, 0), (0.000873, 0.000873, 0), (0.00293, 0.00293, 0)), 0),
    ("smooth", 10, "default"): (((4.22e-11, 4.22e-11, 0), (1.06e-09, 1.06e-09, 0), (1.41e-08, 1.41e-08, 0)), 0),
    ("smooth", 11, "default"): (((1.8e-08, 1.8e-08, 0), (5.61e-05, 5.61e-05, 0), (0.000192, 0.000192, 0)), 0),
    ("smooth", 12, "default"): (((2.83e-06, 2.83e-06, 0), (6.52e-05, 6.52e-05, 0), (0.000547, 0.000547, 0)), 0),
    ("smooth", 13, "default"): (((1.15e-09, 1.15e-09, 0), (3.55e-06, 3.55e-06, 0), (1.15e-05, 1.15e-05, 0)), 0),
    ("smooth", 14, "default"): (((1.12e-09, 1.12e-09, 0), (3.55e-06, 3.55e-06, 0), (1.15e-05, 1.15e-05, 0)), 0),
    ("smooth", 15, "default"): (((4.87e-12, 4.87e-12, 0), (1.36e-08, 1.36e-08, 0), (4.33e-08, 4.33e-08, 0)), 0),
    ("smooth", 0, "others"): (((0.000631, 0.000631, 0), (0.0274, 0.0274, 0), (0.0761, 0.0761, 0)), 0.002),
    ("smooth", 1, "others"): (((0.000749, 0.000749, 0), (0.127, 0.127, 0), (0.28, 0.28, 0)), 0.0098),
    ("smooth", 2, "others"): (((6.02e-05, 6.02e-05, 0), (0.119, 0.119, 0), (0.33, 0.33, 0)), 0.0098),
    ("smooth", 3, "others"): (((5.96e-05, 5.96e-05, 0), (0.119, 0.119, 0), (0.33, 0.33, 0)), 0.0098),
    ("smooth", 4, "others"): (((5.54e-06, 5.54e-06, 0), (0.0141, 0.0141, 0), (0.0545, 0.0545, 0)), 0.002),
    ("smooth", 5, "others"): (((1.91e-07, 1.91e-07, 0), (0.000107, 0.000107, 0), (0.000358, 0.000358, 0)), 0.002),
    ("smooth", 6, "others"): (((2.91e-06, 2.91e-06, 0), (0.00104, 0.00104, 0), (0.00369, 0.00369, 0)), 0),
    ("smooth", 7, "others"): (((4.53e-06, 4.53e-06, 0), (0.0141, 0.0141, 0), (0.0546, 0.0546, 0)), 0.002),
    ("smooth", 8, "others"): (((1.91e-08, 1.91e-08, 0), (5.57e-06, 5.57e-06, 0), (9.4e-06, 9.4e-06, 0)), 0.002),
    ("smooth", 9, "others"): (((2.84e-07, 2.84e-07, 0), (0.00105, 0.00105, 0), (0.0041, 0.0041, 0)), 0),
    ("smooth", 10, "others"): (((4.59e-11, 4.59e-11, 0), (1.22e-09, 1.22e-09, 0), (6.87e-09, 6.87e-09, 0)), 0),
    ("smooth", 11, "others"): (((1.85e-08, 1.85e-08, 0), (6.58e-05, 6.58e-05, 0), (0.000246, 0.000246, 0)), 0),
    ("smooth", 12, "others"): (((3.33e-06, 3.33e-06, 0), (8.22e-05, 8.22e-05, 0), (0.00025, 0.00025, 0)), 0),
    ("smooth", 13, "others"): (((1.27e-09, 1.27e-09, 0), (3.98e-06, 3.98e-06, 0), (1.46e-05, 1.46e-05, 0)), 0),
    ("smooth", 14, "others"): (((1.26e-09, 1.26e-09, 0), (3.98e-06, 3.98e-06, 0), (1.46e-05, 1.46e-05, 0)), 0),
    ("smooth", 15, "others"): (((4.71e-12, 4.71e-12, 0), (1.53e-08, 1.53e-08, 0), (5.51e-08, 5.51e-08, 0)), 0),
    ("stick-slip", 1, "default"): (((0.00215, 0.00129, 0.000119), (2.21, 2.21, 0.126), (INF, INF, INF)), 0.039),
    ("stick-slip", 0, "default"): (((0.000975, 0.000796, 4.29e-05), (0.321, 0.321, 0.0159), (INF, INF, INF)), 0.014),
    ("stick-slip", 2, "default"): (((0.000897, 0.000548, 5.67e-05), (1.96, 1.96, 0.106), (INF, INF, INF)), 0.033),
    ("stick-slip", 4, "default"): (((6.25e-05, 3.55e-05, 3.54e-06), (0.245, 0.237, 0.0131), (1.51, 1.51, 0.105)), 0.019),
    ("stick-slip", 5, "default"): (((1.75e-06, 9.95e-07, 9.69e-08), (0.00144, 0.00107, 7.21e-05), (0.0185, 0.0185, 0.001)), 0.0041),
    ("stick-slip", 8, "default"): (((2.46e-08, 1.64e-08, 1.35e-09), (3.99e-06, 3.99e-06, 2.11e-07), (0.000304, 0.000304, 2.18e-05)), 0.0062),
    ("stick-slip", 10, "default"): (((5.41e-11, 3.9e-11, 2.56e-12), (3.63e-09, 3.54e-09, 2.26e-10), (INF, INF, INF)), 0.0021),
    ("stick-slip", 1, "others"): (((0.00256, 0.00148, 0.00014), (2.8, 2.58, 0.182), (INF, INF, INF)), 0.051),
    ("stick-slip", 0, "others"): (((0.00102, 0.000895, 5.37e-05), (0.312, 0.312, 0.0165), (INF, INF, INF)), 0.019),
    ("stick-slip", 2, "others"): (((0.00118, 0.000668, 7.69e-05), (2.29, 2.28, 0.126), (INF, INF, INF)), 0.046),
    ("stick-slip", 4, "others"): (((8.68e-05, 4.8e-05, 5.98e-06), (0.201, 0.197, 0.0111), (1.71, 1.71, 0.086)), 0.011),
    ("stick-slip", 5, "others"): (((3.21e-06, 1.66e-06, 1.82e-07), (0.00162, 0.00162, 8.32e-05), (0.00696, 0.00696, 0.00049)), 0.0063),
    ("stick-slip", 8, "others"): (((4.46e-08, 2.3e-08, 2.26e-09), (4.1e-06, 3.88e-06, 1.95e-07), (2.26e-05, 2.15e-05, 1.72e-06)), 0.0063),
    ("stick-slip", 10, "others"): (((6.2e-11, 4.42e-11, 2.9e-12), (3.45e-09, 2.83e-09, 2.29e-10), (3.3e-08, 3.3e-08, 2.12e-09)), 0),
    ("ice", 10, "default"): (((4.3e-11, 3.82e-11, 1.15e-12), (2.09e-09, 1.88e-09, 6.95e-11), (5.4e-08, 5.4e-08, 3.34e-09)), 0.0041),
    ("ice", 10, "others"): (((5.08e-11, 4.38e-11, 1.25e-12), (4.2e-09, 4.07e-09, 2.79e-10), (2.53e-07, 2.53e-07, 1.36e-08)), 0.0021),
}
"""By scene, index of the setting and robots: bounds of the quantiles, for each the
worse of both [rad/s], crank angle [rad/s] and slide [m/s], in lengths and seconds of
the default robot; share of walks that end otherwise than their reference."""
