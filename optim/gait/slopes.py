"""Slopes of a gait's value and margins in its decision vector."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, cast

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim.gait.convex.instance import squares_of
from stickslip.optim.gait.convex.limits import affine_ground, affine_torque, ground_of, torque_of
from stickslip.optim.gait.convex.program import TIME
from stickslip.optim.gait.gait import friction_use, terms_on_grid

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.optim.gait.convex.instance import Instance


@dataclass(frozen=True)
class Slopes:
    """Derivatives of a gait problem: b at the nodes is linear in the decision vector, limits are
    linear in it and in b, torque and forces affine in both, and JAX differentiates the value by b
    and by these."""

    instance: Instance

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Gradient of the value; a subgradient at kinks, 0 where there is none."""
        return self._along(self._value, x)

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """Jacobian of GaitProblem.looked_at's margins, in its order."""
        at, squares = self.instance, self._squares
        rows = at.rows[0]
        count = squares.shape[0]
        A, B = (-of.reshape(-1, count) / rows.size[:, None] for of in (rows.A, rows.B))
        whole = B[:, :, None] * squares
        node = np.arange(count)
        whole[:, node, 1 + node] += A
        parts = [whole.reshape(-1, len(x))]
        if at.longest is not None:
            parts.append(-self._along(self._time, x)[None] / at.longest)
        end = squares[-1] / at.units.b
        if at.periodic:
            end = end - squares[0] / at.units.b
        return np.concatenate([*parts, end[None], -end[None]])

    @cached_property
    def _squares(self) -> Float[np.ndarray, "nodes n"]:
        """Derivatives of b at the nodes by the decision vector."""
        grid = self.instance.grid
        shape = grid.theta.shape
        ones = np.eye(grid.theta.size)
        columns = [squares_of(grid, np.zeros(shape), 1.0)]
        columns += [squares_of(grid, one.reshape(shape), 0.0) for one in ones]
        return np.stack([of.ravel() for of in columns], axis=1)

    def _along(self, slope: jax.stages.Wrapped, x: np.ndarray) -> np.ndarray:
        """Chain rule from the slopes in b, and in quantities affine in a and b: the torque, or the
        ground's forces."""
        at, nodes = self.instance, self.instance.profiles[0]
        a = x[1:].reshape(at.grid.theta.shape)
        b = squares_of(at.grid, a, float(x[0]))
        if at.goal.is_friction and slope is self._value:
            given, affine = ground_of(nodes, a, b), affine_ground(nodes)
        else:
            given, affine = (torque_of(nodes, a, b),), (affine_torque(nodes),)
        with jax.enable_x64(True):
            on_b, *on_each = map(np.asarray, slope(b, *given))
        on_a = np.zeros_like(a)
        with np.errstate(invalid="ignore"):
            for on_it, (by_a, by_b, *_) in zip(on_each, affine, strict=True):
                on_a, on_b = on_a + on_it * by_a, on_b + on_it * by_b
            found = on_b.ravel() @ self._squares
            found[1:] += on_a.ravel()
        return np.where(np.isfinite(found), found, 0.0)

    @cached_property
    def _value(self) -> jax.stages.Wrapped:
        at = self.instance

        def demand(b: Array, friction: Array, normal: Array) -> Float[Array, ""]:
            return jnp.asarray(friction_use(friction, normal, jnp))

        def value(b: Array, torque: Array) -> Float[Array, ""]:
            spent = terms_on_grid(at.grid, b, torque, jnp)
            return jnp.asarray(at.goal.of(cast("dict[str, float]", spent)))

        if at.goal.is_friction:
            return jax.jit(jax.grad(demand, argnums=(0, 1, 2)))
        return jax.jit(jax.grad(value, argnums=(0, 1)))

    @cached_property
    def _time(self) -> jax.stages.Wrapped:
        at = self.instance

        def time(b: Array, torque: Array) -> Float[Array, ""]:
            return jnp.asarray(terms_on_grid(at.grid, b, torque, jnp)[TIME])

        return jax.jit(jax.grad(time, argnums=(0, 1)))
