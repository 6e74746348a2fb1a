"""Where a condition that is linear in one number holds."""

import jax.numpy as jnp
from jax import Array


def where_positive(constant: Array, slope: Array) -> tuple[Array, Array]:
    """From and to which t, constant + slope t >= 0, of any shape; none is (inf, -inf)."""
    bound = -constant / jnp.where(slope == 0, 1.0, slope)
    never = (slope == 0) & (constant < 0)
    low = jnp.where(never, jnp.inf, jnp.where(slope > 0, bound, -jnp.inf))
    return low, jnp.where(never, -jnp.inf, jnp.where(slope < 0, bound, jnp.inf))
