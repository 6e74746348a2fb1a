"""The grid holds the stations and moves that it should."""

import numpy as np
import pytest

from stickslip.optim.posture.grid import build_grid
from tests.optim.posture.helpers import over_bump


@pytest.fixture(scope="module")
def grid():
    return build_grid(over_bump(), 5, 2, False)


def test_stations_in_chunks_are_the_stations_at_once(monkeypatch, grid):
    monkeypatch.setattr("stickslip.optim.posture.grid.CHUNK", 80)  # 3 waypoints of 25 pairs
    chunked = build_grid(over_bump(), 5, 2, False)
    for one, other in zip(chunked.layers, grid.layers, strict=True):
        for a, b in zip(one.stations, other.stations, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-9)


def test_the_graph_holds_the_moves_that_the_rate_allows_and_no_others():
    grid = build_grid(over_bump(leg_rate=0.9), 5, 2, False)
    pairs = np.stack(np.meshgrid(grid.rear, grid.front, indexing="ij"), -1).reshape(-1, 2)
    near = np.max(np.abs(pairs[:, None] - pairs), axis=-1) <= 0.9 * 0.6 + 1e-9
    for k in range(9):
        good = near & grid.layers[k].admissible[:, None] & grid.layers[k + 1].admissible
        tails, heads = np.concatenate([np.stack(part) for part in grid.edges(k)], axis=1)
        assert len(set(zip(tails, heads, strict=True))) == len(tails) == np.sum(good)
        assert np.all(good[tails, heads])
