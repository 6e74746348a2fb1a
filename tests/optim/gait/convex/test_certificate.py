"""The least of a Lagrangian at each crank angle, beside a search over many points."""

import numpy as np

from stickslip.optim.gait.convex.certificate import Lagrangian, Polygons, least
from stickslip.optim.gait.convex.grid_problem import Sample


def test_nothing_on_a_fine_lattice_is_below_the_least_and_something_is_near_it():
    rng = np.random.default_rng(7)
    m = 40
    A = np.stack([np.ones(m), -np.ones(m), rng.normal(size=m), rng.normal(size=m)])
    B = np.stack([np.zeros(m), np.zeros(m), rng.normal(size=m), rng.normal(size=m)])
    C = np.stack([np.full(m, 2.0), np.full(m, 2.0), np.full(m, 1.5), np.full(m, 2.5)])
    one, none = np.ones(m), np.zeros(m)
    ends = (np.full(m, 0.01), np.full(m, 3.0))
    polygons = Polygons.of(Sample(A, B, C, (one, none, none), ends, one))
    parts = {name: rng.uniform(0, 1, m) * (rng.uniform(size=m) < 0.6)
             for name in ("inverse", "heat", "work", "root")}  # fmt: skip
    form = Lagrangian(**parts, on_T=rng.normal(size=m), on_b=rng.normal(size=m), rest=none)
    found = least(polygons, form)
    T, b = np.meshgrid(np.linspace(-2, 2, 401), np.linspace(0.01, 3, 400), indexing="ij")
    for i in range(m):
        fits = np.all(A[:, i, None, None] * T + B[:, i, None, None] * b <= C[:, i, None, None], 0)
        rate = np.sqrt(b)
        value = form.inverse[i] / rate + form.heat[i] * T**2 / rate
        value += form.work[i] * np.maximum(T, 0) - form.root[i] * rate
        value += form.on_T[i] * T + form.on_b[i] * b
        lattice = np.min(np.where(fits, value, np.inf))
        assert found[i] <= lattice + 1e-8
        assert lattice - found[i] < 0.05
