"""What every fuzz looks for in a batch: a number that is none where the status says all is well."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from stickslip.dynamics import Status


def unmarked(status: Any, tree: Any) -> np.ndarray:
    """Where, along the first axis, the status is not terminal and a number is not finite."""
    status = np.asarray(status)
    sound = np.ones(status.shape, bool)
    for leaf in jax.tree.leaves(tree):
        values = np.asarray(leaf)
        if np.issubdtype(values.dtype, np.floating):
            axes = tuple(range(status.ndim, values.ndim))
            sound &= np.isfinite(values).all(axis=axes)
    return ~sound & (status <= Status.SLIP_ONSET)
