"""A problem that is one pure function in JAX: its numbers, slopes and batches come from there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_integer, require_kind, shown
from stickslip.dynamics.pytrees import in_float64, kept, read_only, settle
from stickslip.optim.problem import Evaluation, Problem, Result, Structure, as_floats

if TYPE_CHECKING:
    from jaxtyping import Array, Float, PyTree

    from stickslip.optim.problem import Batch, Vector

    Function = Callable[[Any, Array, Array], tuple[Array, Array]]

ACCEPTED = (
    "function(data, x, draw) of JAX operations, which returns (values [k], margins [m]): "
    "numbers or rows of numbers, no margins as jnp.zeros(0)"
)
MEMBER = 2000
"""Bytes that a member of a batch takes for each of its numbers while it is evaluated, about."""


@dataclass(frozen=True, eq=False)
class FunctionProblem(Problem[Result]):
    """A problem whose values and margins one function computes.

    function(data, x, draw): what is to be minimised [k] and the margins [m], satisfied where >= 0
    and scaled to about 1; pure, of arrays in float64. A number counts as a row of one, a list of
    numbers as a row. It is traced once when the problem is made, and ValueError says what it
    returned where that will not do. It is static: define it at a module's top.
    data: a pytree of what it needs. low, high [n]: the bounds. goal: which of the k values
    `objective` is. draw: the number of a random draw, for functions that make one of it. kind:
    what is known of the structure; SMOOTH where slopes exist nearly everywhere. forward: whether
    the gradient is taken by forward differentiation, which is cheaper through a simulation.

    A value that is not finite counts as infinite, slopes that are not as 0. A margin of +inf, a
    limit met by any amount, is met by 1; one of NaN or -inf is missed by 1.
    """

    function: Function
    data: PyTree
    low: Float[np.ndarray, "n"]
    high: Float[np.ndarray, "n"]
    goal: int = 0
    draw: int = 0
    kind: frozenset[Structure] = frozenset({Structure.SMOOTH})
    forward: bool = False

    def __post_init__(self):
        for name in ("low", "high"):
            array = as_floats(name, getattr(self, name), "finite numbers")
            settle(self, **{name: read_only(array)})
        settle(self, data=kept(self.data))
        if self.low.ndim != 1 or self.low.shape != self.high.shape or np.any(self.low > self.high):
            raise ValueError(
                f"low {self.low.shape}, high {self.high.shape}; accepted: [n], low <= high"
            )
        require_kind("function", self.function, Callable, ACCEPTED)  # pyright: ignore[reportArgumentType]
        require_integer("draw", self.draw, low=0, high=2**32 - 1)
        values = self.sizes[0]
        accepted = f"0 to {values - 1}, of {values}"
        require_integer("goal", self.goal, low=0, high=values - 1, accepted=accepted)

    @property
    def structure(self) -> frozenset[Structure]:
        return self.kind

    @property
    def n(self) -> int:
        return len(self.low)

    @property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        return self.low, self.high

    def drawn(self, draw: int) -> FunctionProblem:
        """The same problem with another draw."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), draw=int(draw))
        vars(other).pop("free", None)  # of this draw
        return other

    @cached_property
    def sizes(self) -> tuple[int, int]:
        """Numbers of values and margins, found without computing any."""
        x = jax.ShapeDtypeStruct((self.n,), np.float64)
        draw = jax.ShapeDtypeStruct((), np.uint32)
        try:
            values, margins = in_float64(_at.eval_shape, self.function, self.data, x, draw)
        except jax.errors.JAXTypeError as error:
            why = str(error).split("\n", 1)[0]
            raise ValueError(
                "function asks what a number is while it is traced, as `if x[0] > 0`, float(x) "
                f"and NumPy do (jnp.where, jnp.sin do not): {why}; accepted: {ACCEPTED}"
            ) from error
        return values.shape[0], margins.shape[0]

    def at(self, x: Vector) -> tuple[np.ndarray, np.ndarray]:
        """All values [k] and margins [m] of a point."""
        return _sound(*self._call(_at, self.point(x), np.uint32(self.draw)))

    def at_all(self, X: Any, draws: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """The same of a batch, [B, k] and [B, m]; compiled once for each power of two that B
        rounds up to. draws: one for each point, else the problem's own."""
        draws = np.asarray(np.full(len(X), self.draw) if draws is None else draws, np.uint32)
        count, given = self.filled(X, draws, each=MEMBER * self.n)
        values, margins = self._call(_at_all, *given)
        return _sound(values[:count], margins[:count])

    def evaluate(self, x: Vector) -> Evaluation:
        values, margins = self.at(x)
        feasible = bool(self.meets(np.asarray(x, float), margins))
        missed = float(max(0.0, -np.min(margins, initial=0.0)))
        return Evaluation(float(values[self.goal]), margins, feasible, {"margins": missed})

    def evaluate_all(
        self, X: Batch, draws: np.ndarray | None = None
    ) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B m"]]:
        """See Problem; draws: as in `at_all`."""
        values, margins = self.at_all(X, draws)
        return values[:, self.goal], margins

    def gradient(self, x: Vector) -> Float[np.ndarray, "n"]:
        if Structure.SMOOTH not in self.kind:
            return super().gradient(x)
        at, draw = self.point(x), np.uint32(self.draw)
        return _finite(self._call(_slope, at, draw, static=(self.goal, self.forward)))

    def jacobian(self, x: Vector) -> Float[np.ndarray, "m n"]:
        """See Problem; by forward differentiation."""
        if Structure.SMOOTH not in self.kind:
            return super().jacobian(x)
        return _finite(self._call(_jacobian, self.point(x), np.uint32(self.draw)))

    def _call(
        self, program: Callable[..., Any], *given: object, static: tuple[int, ...] = ()
    ) -> Any:
        found = in_float64(program, self.function, *static, self._data, *given)
        return jax.tree.map(np.asarray, found)

    @cached_property
    def _data(self) -> PyTree:
        """Data on the device: transferring arrays takes longer than many evaluations."""
        return in_float64(jax.device_put, self.data)


def _finite(slopes: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(slopes), slopes, 0.0)


def _sound(values: np.ndarray, margins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Infinite values and margins of -1 or 1 where they are not finite: see FunctionProblem."""
    finite = np.where(np.isfinite(margins), margins, np.where(margins == np.inf, 1.0, -1.0))
    return np.where(np.isfinite(values), values, np.inf), finite


def _computed(function: Function, data: PyTree, x: Array, draw: Array) -> tuple[Array, Array]:
    """Values [k] and margins [m] as floats; ValueError for anything else."""
    try:
        found = function(data, x, draw)
    except TypeError as error:
        if error.__traceback__ is None or error.__traceback__.tb_next is not None:
            raise  # from within it
        raise ValueError(f"function: {error}; accepted: {ACCEPTED}") from error
    try:
        values, margins = (jnp.atleast_1d(jnp.asarray(one, x.dtype)) for one in found)
    except (TypeError, ValueError) as error:
        raise ValueError(f"function returned {shown(found)}; accepted: {ACCEPTED}") from error
    if values.ndim > 1 or margins.ndim > 1 or values.size == 0:
        given = f"function returned values {values.shape}, margins {margins.shape}"
        raise ValueError(f"{given}; accepted: {ACCEPTED}")
    return values, margins


_at = jax.jit(_computed, static_argnums=0)


@partial(jax.jit, static_argnums=0)
def _at_all(function: Function, data: PyTree, X: Array, draws: Array) -> tuple[Array, Array]:
    return jax.vmap(partial(_computed, function, data))(X, draws)


@partial(jax.jit, static_argnums=(0, 1, 2))
def _slope(
    function: Function, goal: int, forward: bool, data: PyTree, x: Array, draw: Array
) -> Array:
    slope = jax.jacfwd if forward else jax.grad
    return slope(lambda x: _computed(function, data, x, draw)[0][goal])(x)


@partial(jax.jit, static_argnums=0)
def _jacobian(function: Function, data: PyTree, x: Array, draw: Array) -> Array:
    return jax.jacfwd(lambda x: _computed(function, data, x, draw)[1])(x)
