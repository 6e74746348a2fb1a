"""Numbers of seeded instances: of a machine, a ground and a box near the usual ones."""

from __future__ import annotations

from typing import Any
from zlib import crc32

import numpy as np


def drawn(seed: int | None, *, spread: float = 0.15, **usual: Any) -> dict[str, Any]:
    """The usual numbers or arrays, each element times a factor of its own, log-uniform from
    1 / (1 + spread) to 1 + spread; without a seed as they are.

    A name's factors depend on the seed and that name alone, so goals of one instance share them.
    """
    if seed is None:
        return usual
    found = dict(usual)
    for name, value in usual.items():
        random = np.random.default_rng([seed, crc32(name.encode())])
        found[name] = value * (1 + spread) ** random.uniform(-1, 1, np.shape(value))
    return found
