"""Friction under the foot, for each kind of floor."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, overload

import jax.numpy as jnp

from stickslip.dynamics.scene import Floor, Grip, Patches, Smoothed, Uniform

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Int


class Friction(NamedTuple):
    """Friction coefficients [-] where the foot stands."""

    mu_static: Float[Array, ""]
    mu_kinetic: Float[Array, ""]


def patch_at(
    floor: Floor, position: Float[Array, ""], direction: Float[Array, ""]
) -> Int[Array, ""]:
    """Index of the patch under a floor position [m]; on an edge, the one it moves into."""
    if not isinstance(floor, Patches):
        return jnp.zeros_like(position, jnp.int32)
    edges = jnp.asarray(floor.edges)
    passed = (edges < position) | ((edges == position) & (direction >= 0))
    return jnp.sum(passed, dtype=jnp.int32)


@overload
def friction_on(
    floor: Uniform | Patches | Smoothed, patch: Int[Array, ""], dtype: DTypeLike
) -> Friction: ...
@overload
def friction_on(floor: Floor, patch: Int[Array, ""], dtype: DTypeLike) -> Friction | None: ...
def friction_on(floor: Floor, patch: Int[Array, ""], dtype: DTypeLike) -> Friction | None:
    """The coefficients on one patch; None on a floor without slip."""
    if isinstance(floor, Grip):
        return None
    if isinstance(floor, Smoothed):
        coefficient = jnp.asarray(floor.mu_kinetic, dtype)
        return Friction(coefficient, coefficient)
    if isinstance(floor, Uniform):
        return Friction(jnp.asarray(floor.mu_static, dtype), jnp.asarray(floor.mu_kinetic, dtype))
    return Friction(
        jnp.asarray(floor.mu_static, dtype)[patch], jnp.asarray(floor.mu_kinetic, dtype)[patch]
    )


def smoothed_direction(floor: Smoothed, velocity: Float[Array, ""]) -> Float[Array, ""]:
    """Smoothed sign of the sliding velocity, between -1 and 1."""
    return jnp.tanh(velocity / jnp.asarray(floor.slip_speed, velocity.dtype))


def edge_ahead(
    floor: Patches, patch: Int[Array, ""], direction: Float[Array, ""], dtype: DTypeLike
) -> Float[Array, ""]:
    """Floor position of the edge the foot moves towards [m]; infinite past the outermost."""
    edges = jnp.asarray(floor.edges, dtype)
    infinite = jnp.full((1,), jnp.inf, dtype)
    bounds = jnp.concatenate([-infinite, edges, infinite])
    return bounds[jnp.where(direction >= 0, patch + 1, patch)]
