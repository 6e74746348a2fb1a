"""What is compared for equality is computed once, whatever else is repeated."""

from __future__ import annotations

from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.grouping import grouped


def operations(function, *given) -> Counter[str]:
    """How often each primitive stands in a program, calls included."""
    found: Counter[str] = Counter()
    left = [jax.make_jaxpr(function)(*given).jaxpr]
    while left:
        for equation in left.pop().eqns:
            inner = equation.params.get("jaxpr")
            if inner is None:
                found[equation.primitive.name] += 1
            else:
                left.append(inner.jaxpr)
    return found


def test_what_a_maximum_compares_is_computed_once_and_other_cheap_numbers_again():
    """Its derivative asks which argument it equals: a repeated one may differ by a rounding."""

    def slope(x, y):
        most, back = jax.vjp(lambda x, y: jnp.maximum(x - y, x * y), x, y)
        return most, *back(x)

    def value(x, y):
        apart = x - y
        return jnp.exp(apart), jnp.sin(apart)

    given = jnp.float32(1.0), jnp.float32(0.25)
    for function, repeated in ((slope, 1), (value, 2)):
        traced = jax.make_jaxpr(function)(*given)
        assert operations(grouped(traced), *given)["sub"] == repeated
        np.testing.assert_allclose(grouped(traced)(*given), function(*given), rtol=1e-6)
