"""Cells, sheets and interpolation."""

import hypothesis.strategies as st
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given

from stickslip.agents.optimum import Axis, Grid, Sheet

UNEVEN = np.array([-1.0, -0.9, 0.2, 1.0, 4.0])
GRID = Grid(
    (
        Sheet("flat", (Axis("a", UNEVEN), Axis.even("b", 0.0, 2.0, 3))),
        Sheet("deep", (Axis.even("a", -1.0, 1.0, 2), Axis("b", UNEVEN), Axis("c", UNEVEN + 5))),
    )
)


def multilinear(sheet: int, a, b, c=0.0):
    """Linear along every axis: what multilinear interpolation gives back."""
    return 1 + 2 * a - b + 3 * a * b if sheet == 0 else a - b * c + 2 * a * b * c


def values(dtype):
    parts = [multilinear(index, *sheet.coordinates().T) for index, sheet in enumerate(GRID.sheets)]
    return jnp.asarray(np.concatenate(parts), dtype)


@jax.jit
def read(values, sheet, a, b, c):
    cell = GRID.cell(GRID.place(sheet, a, b, c))
    return GRID.read(values, cell), cell.outside


inside = st.floats(0.0, 1.0)


@given(sheet=st.integers(0, 1), shares=st.tuples(inside, inside, inside))
def test_functions_linear_along_every_axis_are_read_exactly(float64, sheet, shares):
    axes = GRID.sheets[sheet].axes
    ends = [(float(axis.nodes[0]), float(axis.nodes[-1])) for axis in axes] + [(0.0, 0.0)]
    at = [low + share * (high - low) for (low, high), share in zip(ends, shares, strict=False)]
    found, outside = read(values(float64), sheet, *map(jnp.asarray, at))
    assert not outside
    assert float(found) == pytest.approx(multilinear(sheet, *at), abs=1e-12)


def test_every_node_is_read_as_it_is():
    stored = jnp.arange(GRID.size, dtype=jnp.float32)
    nodes = [np.pad(one.coordinates(), ((0, 0), (0, 3 - len(one.axes)))) for one in GRID.sheets]
    sheets = np.repeat([0, 1], [one.size for one in GRID.sheets])
    at = jnp.asarray(np.concatenate(nodes), jnp.float32)
    found, outside = jax.vmap(lambda sheet, node: read(stored, sheet, *node))(sheets, at)
    assert not np.any(outside)
    np.testing.assert_allclose(found, np.arange(GRID.size), rtol=1e-5)


def test_a_periodic_axis_wraps(dtype):
    axis = Axis.even("angle", 1.0, 3.0, 4, periodic=True)
    index, share, outside = jax.vmap(axis.cell)(jnp.asarray([1.25, 3.25, -0.75, 101.25], dtype))
    assert index.tolist() == [0] * 4
    np.testing.assert_allclose(share, 0.5, atol=1e-4)
    assert not np.any(outside)


def test_what_no_node_covers_is_said_to_be_outside(dtype):
    zero = jnp.zeros((), dtype)
    for at in (-1.1, 4.1, 1e30, float("inf"), float("nan")):
        found, outside = read(values(dtype), 0, jnp.asarray(at, dtype), zero, zero)
        assert outside
        assert np.isfinite(found)
    assert GRID.cell(GRID.place(2, zero)).outside


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ([1.0], "at least two"),
        ([1.0, 1.0], "ascending"),
        ([[1.0, 2.0]], "shape"),
    ],
)
def test_nodes_that_are_none_are_refused_by_name(nodes, words):
    with pytest.raises(ValueError, match=f"nodes of speed.*{words}"):
        Grid((Sheet("one", (Axis("speed", nodes),)),)).validate()
