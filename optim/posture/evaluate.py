"""Evaluation of any number of stations, and of what a problem asks of them, by a few programs.

Compiling takes seconds, a thousand stations half a millisecond. So stations go through in rows,
filled up to SIZES, and problems with ground and vehicle of one structure share programs. What a
problem's stations have in common is handed to JAX once (`Waypoints`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.pytrees import Numeric, bound_program, float64_program, pytree_dataclass
from stickslip.dynamics.ugv import Odometer, PoseSolver, UGVParams
from stickslip.dynamics.ugv.poses import over_poses
from stickslip.optim.posture.criteria import Station, drive_cost, station, torque_left
from stickslip.optim.problem import FEASIBLE, Result, padded

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.optim.posture.criteria import Criterion
    from stickslip.optim.posture.waypoints import PostureData

SIZES = (40, 128, 1024, 16_384)
"""Stations that go through together; more go through one after another, which bounds the memory."""
LIMITS = ("leg_rate", "min_normal", "min_grip", "min_clearance", "min_wheel_clearance")
LIMITS += ("max_torque",)
"""Fields of a posture that limit it."""
A_CALL = 170
"""Stations that take as long as a call takes beside its stations."""


@pytree_dataclass
class Posture:
    """A posture problem as a pytree of numbers: problems of one structure share compiled programs.

    Fields as in PostureProblem; x and friction are [K]. Arrays of angles are [K, 2], rear and front
    leg at each waypoint [rad]; they may lie outside the range.
    """

    params: UGVParams
    odometer: Odometer
    """The track, and the arc length along it."""
    x: Float[Array, "K"]
    friction: Float[Array, "K"]
    leg_rate: Numeric
    """[rad/m], or None: any."""
    min_normal: Numeric
    min_grip: Numeric
    min_clearance: Numeric
    min_wheel_clearance: Numeric
    max_torque: Numeric
    """[N m], or None: any."""
    criterion: Any
    """None where it does not matter, so that all share one program."""
    solver: PoseSolver = field(metadata={"static": True})
    split: tuple[Any, Any] | None = None  # of `station`; min_grip None where it is 0

    def stations(self, angles: Float[Array, "K 2"]) -> Station:
        """The stations of the waypoints [K], in one kernel of a processor (see `over_poses`)."""
        given = (self.params, self.odometer, self.x, angles, self.friction, self.split)
        return over_poses(station, (self.solver,), *given)

    def sloped(self, angles: Float[Array, "K 2"]) -> Sloped:
        """The same with their slopes."""
        given = (self.params, self.odometer, self.x, angles, self.friction, self.split)
        return over_poses(_sloped, (self.solver,), *given)

    def margins(self, at: Station) -> dict[str, Float[Array, "... m"]]:
        """Scaled margin of each constraint of a station, by name; satisfied where >= 0: `slacks`
        over `scales`, and pose: 1 where the vehicle has a place on the track, else -1. Numbers that
        are not finite count as -1."""
        one, sizes = jnp.ones_like(at.N_rear), scales(self.params)
        found = {name: jnp.stack(of, -1) / sizes[name] for name, of in slacks(self, at).items()}
        found["pose"] = jnp.where(at.placed, one, -one)[..., None]
        return {name: jnp.where(jnp.isfinite(of), of, -1) for name, of in found.items()}


@np.errstate(invalid="ignore")
def slacks(limits: Posture | PostureData, at: Station) -> dict[str, list[Any]]:
    """What is left of each limit of a station, in its own unit, by name; kept where >= 0.

    grip: mu N - |F| - min_grip, two smooth terms a wheel. normal: N - min_normal. clearance and
    wheels: less their minima, left out where the solver does. torque: `torque_left`, if limited.
    """
    grip = [mu * N - s * F - limits.min_grip for F, N, mu in at.wheels for s in (1, -1)]
    found = {"grip": grip, "normal": [N - limits.min_normal for _, N, _ in at.wheels]}
    if limits.solver.samples:
        found["clearance"] = [at.clearance - limits.min_clearance]
    if not limits.solver.overlap:
        found["wheels"] = [at.wheel_clearance - limits.min_wheel_clearance]
    if limits.max_torque is not None:
        found["torque"] = torque_left(at, limits.max_torque)
    return found


def scales(params: UGVParams) -> dict[str, Any]:
    """Sizes by which `slacks` are divided: weight, leg length, weight x wheel radius."""
    W, length = params.weight, params.leg_length
    forces = {"grip": W, "normal": W, "torque": W * params.wheel_radius}
    return forces | {"clearance": length, "wheels": length}


class Sloped(NamedTuple):
    """Stations, and their slopes in both angles as a new last axis of all but the status."""

    at: Station
    slopes: Station
    status: Array


def _sloped(*given: Any) -> Sloped:
    """Stations with their slopes; given: as of `station`."""
    *before, angles, friction, split = given

    def numbers(angles: Array) -> tuple[tuple[Array, ...], Array]:
        at = station(*before, leg_angles=angles, friction=friction, split=split)
        return at.numbers, at.status

    def along(angle: Array) -> tuple[tuple[Array, ...], tuple[Array, ...], Array]:
        direction = jnp.broadcast_to(angle, angles.shape)
        return jax.jvp(numbers, (angles,), (direction,), has_aux=True)

    at, slopes, status = jax.vmap(along, out_axes=(None, -1, None))(jnp.eye(2, dtype=angles.dtype))
    return Sloped(Station(*at, status=status), Station(*slopes, status=status), status)


def _rows(posture: Posture, angles: Float[Array, "K 2"]) -> Float[Array, "rows K"]:
    return posture.stations(angles).rows


class Waypoints(NamedTuple):
    """Shared data of one row of `length` stations, on the device. calls: for each `size` of them
    the programs of `rows` and of `sloped`, which take angles [size, 2]."""

    calls: tuple[tuple[Callable[[np.ndarray], jax.Array], Callable[[np.ndarray], Sloped]], ...]
    size: int
    length: int

    @classmethod
    def of(cls, posture: Posture, x: Numeric, friction: Numeric) -> Waypoints:
        """Waypoints of stations, each with its x [m] and mu [-], [length]."""
        x, friction = np.asarray(x), np.asarray(friction)
        with jax.enable_x64(True):
            shared = dict.fromkeys(("x", "friction", "criterion", "odometer", *LIMITS))
            shared = jax.device_put(replace(posture, **shared))
            # From the front contact, within which all ground lies that matters.
            of = posture.params
            reach = float(of.body_length) + 2 * float(of.leg_length + of.wheel_radius)
            # of all calls, that which takes least time: one program for all
            size = min(SIZES, key=lambda size: -(-len(x) // size) * (size + A_CALL))
            begins = range(0, len(x), size)
            parts = [(padded(x, size, i), padded(friction, size, i)) for i in begins]
            longest = max((np.ptp(at) for at, _ in parts), default=0.0)

            def programs(at: np.ndarray, mu: np.ndarray) -> tuple[Any, Any]:
                first = np.min(at) - reach
                ground = posture.odometer.between(first, first + longest + 2 * reach)
                own = jax.device_put({"x": at, "friction": mu, "odometer": ground})
                given = replace(shared, **own)
                return bound_program(_rows, given), bound_program(Posture.sloped, given)

            calls = tuple(programs(*part) for part in parts)
        return cls(calls, size, len(x))

    def rows(self, pairs: Float[np.ndarray, "length 2"]) -> Float[np.ndarray, "rows length"]:
        """The stations at these angles as `Station.rows`, in NumPy."""
        return np.asarray(self.padded_rows(pairs))[:, : self.length]

    def padded_rows(self, pairs: Float[np.ndarray, "length 2"]) -> Any:
        """`rows` and the stations that fill the calls; of one call as it lies on the device."""
        size, calls = self.size, enumerate(self.calls)
        parts = [rows(padded(pairs, size, i * size)) for i, (rows, _) in calls]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1)

    def sloped(self, pairs: Float[np.ndarray, "length 2"]) -> tuple[Station, Station]:
        """Stations and slopes of `Sloped`, in NumPy."""
        size, calls = self.size, enumerate(self.calls)
        parts = [sloped(padded(pairs, size, i * size)) for i, (_, sloped) in calls]
        return jax.tree.map(lambda *of: np.concatenate(of)[: self.length], *parts)[:2]


def stations(posture: Posture, angles: Float[np.ndarray, "... K 2"]) -> Station:
    """`Posture.stations` of any batch of drives [..., K], as NumPy arrays."""
    return Station.of_rows(rows_at(posture, posture.x, posture.friction, angles))


def rows_at(
    posture: Posture,
    x: Float[Array | np.ndarray, "..."],
    friction: Float[Array | np.ndarray, "..."],
    angles: Float[np.ndarray, "... 2"],
) -> Float[np.ndarray, "rows ..."]:
    """`Station.rows` at x, with friction and angles, broadcast."""
    x, friction, angles = map(np.asarray, (x, friction, angles))
    shape = np.broadcast_shapes(x.shape, friction.shape, angles.shape[:-1])
    each = [np.broadcast_to(of, shape).reshape(-1) for of in (x, friction)]
    pairs = np.broadcast_to(angles, (*shape, 2)).reshape(-1, 2)
    return Waypoints.of(posture, *each).rows(pairs).reshape(-1, *shape)


def met(posture: Posture, at: Station) -> dict[str, Bool[np.ndarray, "..."]]:
    """Mask of stations that meet each group, to FEASIBLE; `pose`: finite, too. at: of NumPy."""
    left, sizes = slacks(posture, at).items(), scales(posture.params)
    scaled = {name: np.stack(of) / sizes[name] for name, of in left}
    found = {name: np.all((of >= -FEASIBLE) & (of < np.inf), 0) for name, of in scaled.items()}
    return found | {"pose": np.asarray(at.placed & at.finite)}


def together(drives: int, count: int) -> int:
    """Drives of so many stations that go through in one call, for the least time of all."""
    fitting = [size for size in SIZES if size >= count] or [count]
    size = min(fitting, key=lambda size: -(-drives // (size // count)) * (size + A_CALL))
    return size // count


def finite_cost(
    criterion: Criterion, at: Station, count: Int[Array, ""] | None = None
) -> Float[Array, ""]:
    """The criterion's value of the first `count` stations of a drive (None: of all), the others
    being the last one repeated; infinite where a station's numbers are not finite, never NaN."""
    cost = drive_cost(criterion, at, count)
    return jnp.where(jnp.all(at.finite) & jnp.isfinite(cost), cost, jnp.inf)


value = float64_program(finite_cost)


def value_and_margins(
    posture: Posture, criterion: Criterion, rows: Array, angles: Float[Array, "K 2"]
) -> Float[Array, "1+m"]:
    """The value of `Station.rows`, `Posture.margins` of these stations [K], and with a rate 1 -+
    each leg's move over what it allows [K-1, 4], in one array; no rows past the last waypoint."""
    at = Station.of_rows(rows[:, : len(angles)])
    margins = list(posture.margins(at).values())
    if posture.leg_rate is not None:
        share = jnp.diff(angles, axis=0) / (posture.leg_rate * jnp.diff(posture.x))[:, None]
        margins.append(jnp.concatenate([1 - share, 1 + share], -1))
    return jnp.concatenate([finite_cost(criterion, at)[None], *map(jnp.ravel, margins)])


value_and_margins_all = jax.vmap(value_and_margins, (None, None, 1, 0))
"""The same of a batch of drives, stations [B, K] and angles [B, K, 2]: [B, 1+m]."""


@float64_program
def gradient(criterion: Criterion, at: Station, slopes: Station) -> Float[Array, "K 2"]:
    """Slope of the value in every angle; 0 where it is not finite."""

    def cost(numbers: tuple[Array, ...]) -> Array:
        return finite_cost(criterion, at.with_numbers(numbers))

    parts = []
    for weight, slope in zip(jax.grad(cost)(at.numbers), slopes.numbers, strict=True):
        product = weight[..., None] * slope  # [K, 2], or [K, 2, 2] through a pair
        parts.append(product if weight.ndim == 1 else jnp.sum(product, 1))
    whole = reduce(jnp.add, parts)
    return jnp.where(jnp.isfinite(whole), whole, 0)


@float64_program
def margins_and_slopes(
    posture: Posture, at: Station, slopes: Station
) -> tuple[dict[str, Float[Array, "K m"]], dict[str, Float[Array, "K m 2"]]]:
    """Each station's margins and their slopes in its own two angles; slopes 0 where not finite."""

    return pushed(posture.margins, (at,), (each_angle(slopes),))


def each_angle(slopes: Station) -> Station:
    """Slopes with the angle as first axis."""
    numbered = slopes._replace(status=jnp.zeros_like(slopes.N_rear))
    return numbered.map(lambda of: jnp.moveaxis(of, -1, 0))


def pushed(function: Callable[..., Any], at: tuple[Station, ...], each: tuple[Station, ...]):
    """The function's value, and its slopes as a new last axis; 0 where not finite."""
    numbers = tuple(of.numbers for of in at)

    def of_numbers(*numbers: tuple[Array, ...]) -> Any:
        return function(*(of.with_numbers(one) for of, one in zip(at, numbers, strict=True)))

    directions = tuple(of.numbers for of in each)
    slopes = jax.vmap(lambda *d: jax.jvp(of_numbers, numbers, d)[1], out_axes=-1)(*directions)
    return function(*at), jax.tree.map(lambda v: jnp.where(jnp.isfinite(v), v, 0), slopes)


@dataclass(frozen=True)
class PostureResult(Result):
    """The outcome of `solve` for a posture problem: see Result; and of the same drive on waypoints
    `fine_spacing` [m] apart, ten times closer, the legs moving evenly from one to the next
    (`evaluate_finer`), fine_value, fine_feasible and fine_residuals: what the problem, and so every
    bound, knows nothing of.
    """

    fine_value: float = np.inf
    fine_spacing: float = np.nan
    fine_feasible: bool = False
    fine_residuals: Mapping[str, float] = field(default_factory=dict)

    @property
    def leg_angles(self) -> Float[np.ndarray, "K 2"] | None:
        """x as pairs, rear and front leg at each waypoint [rad]."""
        return None if self.x is None else self.x.reshape(-1, 2)


def violations(
    problem: PostureData, angles: Float[np.ndarray, "K 2"], at: Station
) -> dict[str, float]:
    """Largest violation of each constraint, 0 where it is met: see
    PostureProblem.residuals. at: the stations [K] at these angles."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    missed: dict[str, list[Any]] = {"leg_range": [low - angles, angles - high]}
    for name, k in (("start_angles", 0), ("end_angles", -1)):
        if getattr(problem, name) is not None:
            missed[name] = [np.abs(angles[k] - getattr(problem, name))]
    if problem.leg_rate is not None:
        rate = np.abs(np.diff(angles, axis=0)) / np.diff(problem.x)[:, None]
        missed["leg_rate"] = [rate - problem.leg_rate]
    missed |= {name: [-left for left in of] for name, of in slacks(problem, at).items()}
    worst = {name: float(np.max(np.stack(of))) for name, of in missed.items()}
    worst["pose"] = float(np.sum(~np.asarray(at.placed)))
    return {name: np.inf if np.isnan(of) else max(of, 0.0) for name, of in worst.items()}


def tolerated(problem: PostureData, name: str) -> float:
    """Tolerance of a residual of that name, FEASIBLE in the scale of its constraint."""
    sizes = scales(problem.params) | {"leg_rate": problem.leg_rate}
    return FEASIBLE * float(sizes.get(name, 1.0) or 1.0)


# By other means (bisection, other equations, other quadrature) torques and turns differ by 1e-15 to
# 2e-13 of themselves, also on ground 1 km long and 1500 m high; next to nothing, by roundings of
# the vehicle's weight. A bound that is called proved is lowered by more than both.
RELATIVE = 5e-13
"""Relative rounding error of the value."""
ROUNDINGS = 4 * float(np.finfo(float).eps)
"""Rounding error relative to the vehicle's weight."""


def natural(problem: PostureData) -> float:
    """Natural scale from the vehicle's weight, in the criterion's unit."""
    weight, length = float(problem.params.weight), float(problem.x[-1] - problem.x[0])
    torque = weight * float(problem.params.wheel_radius)
    of = {"J": weight * length, "N m": torque, "N^2 m": torque**2 / length, "N": weight}
    return of.get(problem.criterion.unit, 1.0)


def below(problem: PostureData, value: float) -> float:
    """A number that the exact value of a drive is not below, where `value` was computed."""
    absolute = ROUNDINGS * natural(problem)
    if problem.criterion.unit == "N^2 m":
        # Of a sum of (dM)^2 / dx, each M being off by `torque`, by Cauchy and Schwarz.
        torque = ROUNDINGS * float(problem.params.weight) * float(problem.params.wheel_radius)
        length = float(problem.x[-1] - problem.x[0])
        least_step = float(np.min(np.diff(problem.x)))
        rest = torque * length / least_step
        absolute = (2 * np.sqrt(abs(value) * length) + rest) * torque / least_step
    elif problem.criterion.unit == "-":
        absolute *= 1 + value * value
    return value - (RELATIVE * abs(value) + float(absolute))
