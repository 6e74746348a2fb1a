"""Value iteration against optima that are known."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.optimum import Axis, Grid, Sheet
from stickslip.agents.optimum.value_iteration import (
    finite_horizon,
    transitions,
)
from tests.agents.optimum.processes import Chain, DoubleIntegrator


def test_a_chain_has_the_values_counted_by_hand(dtype):
    table = transitions(Chain.of(dtype), -50.0)
    found = finite_horizon(table, 4)
    # From the place 5 - n the prize is n moves away; place 5 itself is where one step more ends it.
    assert found.dtype == dtype
    assert found.tolist() == [0.0, 1.5, 1.625, 1.75, 1.875, 2.0]
    assert finite_horizon(table, 5).tolist()[0] == 2 - 5 * 0.125


def test_a_regulator_has_riccatis_value_and_the_error_falls_with_the_square_of_the_cells(float64):
    steps, errors = 20, []
    inner = np.abs(DoubleIntegrator.of(16).grid.sheets[0].coordinates()).max(1) <= 1
    at = DoubleIntegrator.of(16).grid.sheets[0].coordinates()[inner]
    exact = -np.einsum("ni,ij,nj->n", at, DoubleIntegrator.of(16).riccati(steps), at)
    for cells in (32, 64):
        process = DoubleIntegrator.of(cells, float64)
        value = finite_horizon(transitions(process, -1e3), steps)
        places = jax.vmap(process.place)(jnp.asarray(at))
        found = jax.vmap(lambda place, p=process, v=value: p.grid.read(v, p.grid.cell(place)))
        errors.append(np.max(np.abs(found(places) - exact)))
    assert errors[1] < 0.05 * np.max(np.abs(exact))
    assert errors[0] / errors[1] > 3


def test_a_grid_too_large_is_refused_with_its_size_before_it_exists():
    plane = tuple(Axis.even(name, 0.0, 1.0, 30_000) for name in "ab")
    process = Chain(jnp.zeros((3, 1)), Grid((Sheet("plane", plane),)))
    with pytest.raises(ValueError, match=r"30001 x 30001: 900,060,001 nodes with 3 actions.*2\.7e"):
        transitions(process, 0.0)
