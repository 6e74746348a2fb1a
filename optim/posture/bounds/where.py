"""At which waypoints cells are worth halving: where the bound loses by the best drive known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.posture.bounds.lattice import Axis

BESIDE = 4
"""Waypoints on either side of those that are halved, so that the rate is known there."""
LEFT = 0.1
"""Share of the loss that the other waypoints may have."""
NEAR = 0.25
"""Worst stations: of the range of the best drive's stations, how near to the bound they count."""


def place(axes: tuple[Axis, Axis], angles: Float[np.ndarray, "2"]) -> tuple[list[int], np.ndarray]:
    """The cell of a posture, and its corners' weights: (0, 0), (0, 1), (1, 0), (1, 1)."""
    cell, shares = [], []
    for axis, angle in zip(axes, angles, strict=True):
        at = int(np.clip(np.searchsorted(axis.nodes, angle) - 1, 0, len(axis.nodes) - 2))
        cell.append(at)
        shares.append(np.clip((angle - axis.nodes[at]) / axis.widths[at], 0.0, 1.0))
    (i, j) = shares
    return cell, np.array([(1 - i) * (1 - j), (1 - i) * j, i * (1 - j), i * j])


def lossy(left: Float[np.ndarray, "K"], go: Float[np.ndarray, "K"]) -> Bool[np.ndarray, "K"]:
    """Waypoints at which a sum loses. left: cost to go by the bound; go: by the best drive."""
    loss = np.maximum(-np.diff(np.asarray(go) - np.asarray(left)), 0.0)
    worth = np.zeros(len(left), bool)
    order = np.argsort(-loss)
    missing = np.sum(loss) - np.cumsum(loss[order])
    most = order[: 1 + int(np.searchsorted(-missing, -LEFT * np.sum(loss)))]
    worth[most] = worth[most + 1] = True
    return _beside(worth)


def bottleneck(costs: Float[np.ndarray, "K"], bound: float) -> Bool[np.ndarray, "K"]:
    """Waypoints at which a worst station loses. costs: of the best drive, by the bound."""
    return _beside(costs >= min(bound, np.max(costs)) - NEAR * np.ptp(costs))


def _beside(worth: np.ndarray) -> np.ndarray:
    whole = np.convolve(worth, np.ones(2 * BESIDE + 1))
    return whole[BESIDE : BESIDE + len(worth)] > 0  # "same" is as long as the longer of the two
