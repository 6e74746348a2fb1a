"""Criteria of a drive, all minimised: sums over its steps or worst stations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_choice, require_number, shown
from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.pytrees import register_pytree
from stickslip.optim.posture.names import CRITERIA_IN_WORDS
from stickslip.optim.posture.station import Station, turned

if TYPE_CHECKING:
    from jaxtyping import Array, Float

LEAST_NORMAL = 1e-3
"""A wheel that carries less than this [N] is taken to carry it where friction is divided by it."""


@jax.tree_util.register_static
@dataclass(frozen=True)
class Criterion:
    """One criterion; static and hashable.

    kind "sum": terms(a, b) gives [..., m] smooth terms of the step from station a to station b;
    the value is the sum over steps and terms of outer(term), outer being "positive", max(0, t),
    or "square", t^2. kind "max": terms(a) gives [..., m] smooth terms of one station; the value is
    the largest over stations and terms. unit: of the value. pointwise(a, before): for sums, what
    stands for it where each station is judged alone, `before` being the station chosen before it.
    """

    name: str
    kind: str
    unit: str
    about: str
    terms: Callable[..., Array]
    outer: str | None = None
    pointwise: Callable[[Station, Station], Array] | None = None


@register_pytree
@dataclass(frozen=True)
class Weighted:
    """A weighted sum of criteria: ((criterion or its name, weight >= 0), ...).

    Weights carry the units' reciprocals; they are numbers under jit, so that another choice of
    them compiles nothing.
    """

    parts: tuple[tuple[Criterion, Numeric], ...]

    def __post_init__(self):
        try:
            pairs = [(one, weight) for one, weight in self.parts]
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"parts = {shown(self.parts)}; accepted: pairs of a criterion or its name and "
                "a weight"
            ) from error
        parts = tuple((criterion_by_name(one), weight) for one, weight in pairs)
        if not parts or any(isinstance(one, Weighted) for one, _ in parts):
            raise ValueError(f"parts = {shown(self.parts)}; accepted: one single criterion or more")
        object.__setattr__(self, "parts", parts)

    def validate(self) -> Weighted:
        """Return self, or raise ValueError for a weight that is no number >= 0, or none above 0;
        not in __init__, which JAX calls with whatever a tree is made to hold."""
        for one, weight in self.parts:
            name, accepted = f"weight of {one.name}", "a finite number >= 0"
            require_number(name, weight, low=0.0, accepted=accepted, dtype=np.float64)
            if np.ndim(weight):
                raise ValueError(f"{name} has shape {np.shape(weight)}; accepted: {accepted}")
        if not any(weight for _, weight in self.parts):
            raise ValueError("weights of 0; accepted: numbers >= 0, one of them > 0")
        return self

    @property
    def name(self) -> str:
        """Its parts' names with their weights."""
        return " + ".join(f"{weight:.4g} {one.name}" for one, weight in self.parts)

    @property
    def unit(self) -> str:
        """Unit of the weighted sum, which depends on the weights."""
        return "-"

    @property
    def kind(self) -> str:
        """ "sum" when all parts are sums over steps, else "mixed"."""
        return "sum" if all(one.kind == "sum" for one, _ in self.parts) else "mixed"


def _wheel_work(a: Station, b: Station) -> Array:
    return ((a.torque + b.torque) / 2 * turned(a, b))[..., None]


def _total_work(a: Station, b: Station) -> Array:
    legs = (a.leg_torques + b.leg_torques) / 2 * (b.leg_angles - a.leg_angles)
    return jnp.concatenate([_wheel_work(a, b), legs], -1)


def _torque_slope(a: Station, b: Station) -> Array:
    return ((b.torque - a.torque) / jnp.sqrt(b.x - a.x))[..., None]


def _torque(a: Station) -> Array:
    return jnp.stack([a.torque, -a.torque], -1)


def _grip_missing(a: Station) -> Array:
    return jnp.stack([sign * F - mu * N for F, N, mu in a.wheels for sign in (1, -1)], -1)


def _load(a: Station) -> Array:
    return -jnp.stack([a.N_rear, a.N_front], -1)


def _demand(a: Station) -> Array:
    rear = a.F_rear / jnp.maximum(a.N_rear, LEAST_NORMAL)
    front = a.F_front / jnp.maximum(a.N_front, LEAST_NORMAL)
    return jnp.stack([rear, -rear, front, -front], -1)


def _torque_size(a: Station, before: Station) -> Array:
    return jnp.abs(a.torque)


def _torque_change(a: Station, before: Station) -> Array:
    return jnp.abs(a.torque - before.torque)


def _in_words(name: str, kind: str, unit: str, *terms: Any) -> Criterion:
    """The criterion with the words that are kept beside its name."""
    return Criterion(name, kind, unit, CRITERIA_IN_WORDS[name], *terms)


CRITERIA: dict[str, Criterion] = {
    one.name: one
    for one in (
        _in_words("wheel_energy", "sum", "J", _wheel_work, "positive", _torque_size),
        _in_words("total_energy", "sum", "J", _total_work, "positive", _torque_size),
        _in_words("peak_torque", "max", "N m", _torque),
        _in_words("torque_variation", "sum", "N^2 m", _torque_slope, "square", _torque_change),
        _in_words("grip", "max", "N", _grip_missing),
        _in_words("normal_force", "max", "N", _load),
        _in_words("friction_demand", "max", "-", _demand),
    )
}
"""All criteria by name."""


def criterion_by_name(criterion: str | Criterion | Weighted) -> Criterion | Weighted:
    """The criterion of that name, or the one given."""
    if isinstance(criterion, Weighted):
        return criterion.validate()
    if isinstance(criterion, Criterion):
        return criterion
    require_choice("criterion", criterion, tuple(CRITERIA))
    return CRITERIA[criterion]


def step_cost(criterion: Criterion | Weighted, a: Station, b: Station) -> Float[Array, "..."]:
    """Cost of the step from a to b, for criteria whose kind is "sum"."""
    if isinstance(criterion, Weighted):
        return _weighted(criterion, [step_cost(one, a, b) for one, _ in criterion.parts])
    terms = criterion.terms(a, b)
    each = jnp.square(terms) if criterion.outer == "square" else larger(terms, 0)
    return jnp.sum(each, -1)


def station_cost(criterion: Criterion, a: Station) -> Float[Array, "..."]:
    """The largest of a station's terms; for criteria whose kind is "max"."""
    return largest(criterion.terms(a), -1)


def pointwise_cost(
    criterion: Criterion | Weighted, a: Station, before: Station
) -> Float[Array, "..."]:
    """A station judged alone: its cost, or what stands for it where the criterion is a sum."""
    if isinstance(criterion, Weighted):
        return _weighted(criterion, [pointwise_cost(one, a, before) for one, _ in criterion.parts])
    return criterion.pointwise(a, before) if criterion.pointwise else station_cost(criterion, a)


def drive_cost(
    criterion: Criterion | Weighted, stations: Station, count: Numeric | None = None
) -> Float[Array, "..."]:
    """The value of a whole drive; waypoints along the stations' leading axis, [K, ...].

    count: how many of them make up the drive, the others being the last one repeated.
    """
    if isinstance(criterion, Weighted):
        return _weighted(
            criterion, [drive_cost(one, stations, count) for one, _ in criterion.parts]
        )
    if criterion.kind == "max":
        return largest(station_cost(criterion, stations), 0)
    cost = step_cost(criterion, *steps(stations))
    if count is not None:
        cost = jnp.where(jnp.arange(len(cost), dtype=jnp.int32) < count - 1, cost, 0)
    return jnp.sum(cost, 0)


def steps(stations: Station) -> tuple[Station, Station]:
    """Starts and ends of the steps between stations [K, ...]: two of [K-1, ...]."""
    return stations.map(lambda of: of[:-1]), stations.map(lambda of: of[1:])


def increase(
    criterion: Criterion,
    so_far: Float[Array, "..."],
    a: Station,
    b: Station,
    first: Numeric,
) -> Float[Array, "..."]:
    """Increase of the cost so far by the step from a to b; first: it is a drive's first step.

    The increases along a drive add up to `drive_cost`, from a cost of 0.
    """
    if criterion.kind == "sum":
        return step_cost(criterion, a, b)
    begin, end = station_cost(criterion, a), station_cost(criterion, b)
    return larger(jnp.where(first, begin, larger(so_far, begin)), end) - so_far


def larger(a: Array, b: Numeric) -> Array:
    """max(a, b) with the slope of the one it is.

    That of jnp.maximum and jnp.max asks which operand equals the result, which fails under jit
    where the operand is computed twice, rounded differently; then the slope is lost.
    """
    return jnp.where(a > b, a, b)


def largest(terms: Array, axis: int) -> Array:
    """The same along an axis: the largest entry with the slope of the first that is it."""
    which = jnp.expand_dims(jnp.argmax(jax.lax.stop_gradient(terms), axis), axis)
    return jnp.take_along_axis(terms, which, axis).squeeze(axis)


def _weighted(criterion: Weighted, values: list[Array]) -> Array:
    products = [
        jnp.asarray(weight, value.dtype) * value
        for (_, weight), value in zip(criterion.parts, values, strict=True)
    ]
    return reduce(jnp.add, products)
