"""The friction under each step of a walk that does not slip."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.numeric import read_only
from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform
from stickslip.optim.options import as_floats

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.dynamics.numeric import Lists, Number

ACCEPTED = "None, a number >= 0, one for each step, or a Scene of dry friction"


def friction_along(
    mu: Number | Lists | Scene | None, steps: int, step_length: float
) -> Float[np.ndarray, "n"] | None:
    """Static friction of each step [n], None where the foot never slips.

    A scene's patches count where the supporting ankle stands: step k at k step lengths [m].
    """
    if mu is None:
        return None
    if not isinstance(mu, Scene):
        found = as_floats("mu", mu, ACCEPTED)
        if found.shape not in ((), (steps,)):
            raise ValueError(f"mu has shape {found.shape}; accepted: one number, or ({steps},)")
    else:
        floor = mu.floor
        if isinstance(floor, Grip):
            return None
        if isinstance(floor, Patches):
            edges = as_floats("edges", floor.edges, "finite positions [m]")
            coefficients = as_floats("mu_static", floor.mu_static, "numbers >= 0")
            at = np.searchsorted(edges, step_length * np.arange(steps), side="right")
            found = np.broadcast_to(coefficients, (len(edges) + 1,))[at]
        elif isinstance(floor, Uniform):
            found = as_floats("mu_static", floor.mu_static, ACCEPTED)
        else:
            raise ValueError(f"mu is a scene with the floor {floor!r}; accepted: {ACCEPTED}")
        if found.ndim > 1 or (found.ndim == 1 and found.shape != (steps,)):
            raise ValueError(f"mu is a batch of floors {found.shape}; accepted: one floor")
    if np.any(found < 0):
        raise ValueError(f"mu = {float(np.min(found))!r} is not accepted; accepted: {ACCEPTED}")
    return read_only(np.broadcast_to(found, (steps,)).astype(float))
