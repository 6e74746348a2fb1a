"""Clearance of body and legs above the ground, and between the wheels.

In width the half vehicle has three planes, so that what lies in different ones may pass each other:
the body, then both legs, then both wheels. The legs never meet: UGVParams refuses a body that is no
longer than both legs folded inwards, so that the rear leg and wheel stay behind the front ones.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.batch_axes import jvp_in_front
from stickslip.dynamics.ugv.ground.near import Near
from stickslip.dynamics.ugv.params import UGVParams

if TYPE_CHECKING:
    from stickslip.dynamics.ugv.contact.placed import Pose
    from stickslip.dynamics.ugv.ground.shapes import Points, Values


def clearance(params: UGVParams, ground: Near, placed: Pose, samples: int) -> Values:
    """Least height above the ground of the body and of what the wheels leave of the legs [m]."""
    if samples == 0:
        return jnp.full_like(placed.wheelbase, jnp.inf)
    bare = jnp.maximum(1 - params.wheel_radius / params.leg_length, 0)
    rear = placed.rear_hinge + bare * (placed.rear.centre - placed.rear_hinge)
    front = placed.front_hinge + bare * (placed.front.centre - placed.front_hinge)
    corners = [rear, placed.rear_hinge, placed.front_hinge, front]
    return _least_height(samples, ground, [(a, b - a) for a, b in pairwise(corners)])


def wheel_clearance(params: UGVParams, wheelbase: Values) -> Values:
    """Distance of the wheels' rims less the required gap [m]; negative: the wheels overlap."""
    return wheelbase - (2 * params.wheel_radius + params.wheel_gap)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _least_height(samples: int, ground: Near, lines: list[tuple[Points, Points]]) -> Values:
    """Least height of `samples` points on each line (begin, way) above the ground [m].

    One point after the other: for a batch their numbers stay in the nearest cache. Derivatives are
    those of jnp.min, which divides them among points of the same height.
    """

    def look(place, least):
        part = (jnp.asarray(place, least.dtype) + 0.5) / samples
        for begin, way in lines:
            x, y = begin[..., 0] + part * way[..., 0], begin[..., 1] + part * way[..., 1]
            least = jnp.minimum(least, y - ground.height(x))
        return least

    nothing = jnp.full_like(lines[0][0][..., 0], jnp.inf)
    return jax.lax.fori_loop(0, samples, look, nothing)


@_least_height.defjvp
def _least_height_jvp(samples: int, primals, tangents):
    def at_once(ground, lines):
        least = None
        for begin, way in lines:
            (x, y), (along, up) = ((v[..., :1], v[..., 1:]) for v in (begin, way))
            part = (jnp.arange(samples, dtype=x.dtype) + 0.5) / samples
            lowest = jnp.min(y + part * up - ground.height(x + part * along), axis=-1)
            least = lowest if least is None else jnp.minimum(least, lowest)
        return least

    return jvp_in_front(at_once, primals, tangents)
