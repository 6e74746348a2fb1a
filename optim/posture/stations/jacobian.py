"""The slopes of all constraints of a drive, put together from those of its stations and steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Float


def whole_jacobian(
    blocks: Mapping[str, Float[np.ndarray, "K m 2"]],
    groups: Mapping[str, slice],
    per_angle: Float[np.ndarray, "K-1"] | None,
) -> Float[np.ndarray, "all n"]:
    """Rows as PostureProblem.constraints has them, by the flat decision vector.

    blocks: of each group, the slopes of a station's margins in its own two angles. groups: where
    each group lies. per_angle: slope of `leg_rate` in a leg's move at each step [1/rad]; None: no
    such group.
    """
    K = len(next(iter(blocks.values())))
    rows = np.zeros((max(of.stop for of in groups.values()), 2 * K))
    for name, slope in blocks.items():
        m = slope.shape[1]
        block = rows[groups[name]].reshape(K, m, K, 2)
        block[np.arange(K), :, np.arange(K)] = slope
    if per_angle is not None:
        step = np.arange(K - 1)
        block = rows[groups["leg_rate"]].reshape(K - 1, 2, 2, K, 2)
        for leg in range(2):
            for row, sign in enumerate((-1, 1)):
                block[step, row, leg, step, leg] = -sign * per_angle
                block[step, row, leg, step + 1, leg] = sign * per_angle
    return rows
