"""A wheel on the ground (eq. 38), and the search for the rear contact: where the path of the rear
centre meets the circle about the front one (eq. 39)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_choice, require_integer, require_kind
from stickslip.dynamics.kernels.fused import where_needed
from stickslip.dynamics.pytrees import require_one
from stickslip.dynamics.ugv.ground.shapes import Near
from stickslip.dynamics.ugv.track import Track

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.ugv.ground.shapes import Points, Values

    Sampled = tuple[tuple[Values, Values, Values], Values, Values, Int[Array, "..."]]
    Search = tuple[Values, Values, Values, Values, Bool[Array, "..."]]
    """The point, the bracket's ends, the miss before, whether it is found."""

NARROWINGS = 10
"""Narrowings of the interval in which the ground is nearest to a wheel's centre."""


class WheelContact(NamedTuple):
    """A wheel's contact with the ground; vectors [..., 2] in the world frame."""

    x: Float[Array, "..."]
    """Contact point [m]."""
    point: Float[Array, "... 2"]
    """The same as a point (x, f(x)) [m]."""
    centre: Float[Array, "... 2"]
    """The wheel's centre (s, g) of eq. (38) [m]."""
    tangent: Float[Array, "... 2"]
    """(cos beta, sin beta), along the ground forwards."""
    stretch: Float[Array, "..."]
    """Distance that the centre moves for each metre of ground [-]: 1 less radius over the ground's
    radius of curvature. Not positive: the ground is hollower than the wheel."""

    @property
    def slope_angle(self) -> Values:
        """beta = atan f'(x) [rad]."""
        return jnp.arctan2(self.tangent[..., 1], self.tangent[..., 0])

    @property
    def normal(self) -> Points:
        """(-sin beta, cos beta), out of the ground."""
        return jnp.stack([-self.tangent[..., 1], self.tangent[..., 0]], -1)


def contact(track: Track | Near, x: Float[Array, "..."], radius: Values | float) -> WheelContact:
    """The contact at x (eq. 38, with f' for the f that is printed there); no check for a second."""
    f, df, d2f = track.profile(x)
    q = jnp.sqrt(1 + df**2)
    cos, sin = 1 / q, df / q
    return WheelContact(
        x=x,
        point=jnp.stack([x, f], -1),
        centre=jnp.stack([x - radius * sin, f + radius * cos], -1),
        tangent=jnp.stack([cos, sin], -1),
        stretch=1 - radius * d2f / q**3,
    )


def penetration(
    track: Track | Near, wheel: WheelContact, radius: Values | float, samples: int
) -> Values:
    """Penetration of the ground into the wheel [m], >= 0: zero for a single contact.

    The distance from the wheel's centre to the ground is looked up below `samples` points of the
    rim, and between two of them that enclose a minimum, the nearest such pair beside the contact,
    it is narrowed down. Ground narrower than about 2 radius / samples may hide; on random splines
    what hid was up to 0.0018 of the radius deep with 16 samples (docs/machines.md).
    """
    track, wheel, radius = jax.lax.stop_gradient((track, wheel, radius))  # it only judges
    radius = jnp.asarray(radius, wheel.x.dtype)
    deepest, place = _deepest_sample(track, wheel, radius, samples)
    narrowed, given = partial(_narrowed_down, samples), (track, wheel, radius, place, deepest)
    deepest = where_needed(jnp.any(place > 0), narrowed, given, deepest)
    return jnp.maximum(radius - deepest, 0)


def _below_rim(wheel: WheelContact, radius: Values, at: Int[Array, "..."], samples: int) -> Values:
    """x of the sample of that number [m], from the rear end of the wheel to the front one."""
    part = (jnp.asarray(at, wheel.x.dtype) + 0.01) / (samples - 0.98)
    return wheel.centre[..., 0] - radius * jnp.cos(jnp.pi * part)


def _deepest_sample(
    track: Track | Near, wheel: WheelContact, radius: Values, samples: int
) -> tuple[Values, Int[Array, "..."]]:
    """The least distance of a sample from the centre [m]; the number of the one in front of the
    nearest minimum beside the contact, 0 where there is none.

    A minimum lies between two points where the distance falls at the left and grows at the right,
    or where it ends lower than it began though it grows at both (an edge), or higher though it
    falls at both. The contact is one of them.
    """

    def look(place: jax.Array, carry: Sampled) -> Sampled:
        (left, d_left, g_left), deepest, nearest, chosen = carry
        right = _below_rim(wheel, radius, place, samples)
        d_right, g_right = _from_centre(track, wheel.centre, right)
        touching = (left <= wheel.x) & (wheel.x <= right)
        encloses = _encloses(d_left, g_left, d_right, g_right) & ~touching
        value = jnp.where(encloses, jnp.minimum(d_left, d_right), jnp.inf)
        chosen = jnp.where(value < nearest, place, chosen)
        here = right, d_right, g_right
        return here, jnp.minimum(deepest, d_right), jnp.minimum(nearest, value), chosen

    zero = jnp.zeros(wheel.x.shape, jnp.int32)
    first = _below_rim(wheel, radius, zero, samples)
    start = first, *_from_centre(track, wheel.centre, first)
    carry = start, start[1], jnp.full_like(wheel.x, jnp.inf), zero
    # A loop: for a batch its numbers stay in the nearest cache.
    _, deepest, _, place = jax.lax.fori_loop(1, samples, look, carry)
    return deepest, place


def _narrowed_down(
    samples: int,
    track: Track | Near,
    wheel: WheelContact,
    radius: Values,
    place: Int[Array, "..."],
    deepest: Values,
) -> Values:
    """The least distance [m] between a sample, where one was found, and the one before it."""
    low, high = (_below_rim(wheel, radius, at, samples) for at in (place - 1, place))
    (d_low, g_low), (_, g_high) = (_from_centre(track, wheel.centre, at) for at in (low, high))

    def narrow(_: jax.Array, carry: tuple[Values, ...]) -> tuple[Values, ...]:
        low, high, d_low, g_low, g_high, least = carry
        secant = (low * g_high - high * g_low) / jnp.where(g_high == g_low, 1, g_high - g_low)
        margin = (high - low) / 8
        at = jnp.where((g_low < 0) & (g_high > 0), secant, (low + high) / 2)
        at = jnp.clip(at, low + margin, high - margin)
        d, g = _from_centre(track, wheel.centre, at)
        before = _encloses(d_low, g_low, d, g)
        high, g_high = jnp.where(before, at, high), jnp.where(before, g, g_high)
        low, d_low, g_low = (
            jnp.where(before, old, new) for old, new in ((low, at), (d_low, d), (g_low, g))
        )
        return low, high, d_low, g_low, g_high, jnp.minimum(least, d)

    # A loop, not unrolled: the CPU compiler would repeat the profile through the whole chain.
    carry = (low, high, d_low, g_low, g_high, deepest)
    least = jax.lax.fori_loop(0, NARROWINGS, narrow, carry)[-1]
    return jnp.where(place > 0, least, deepest)


def _encloses(
    d_left: Values, g_left: Values, d_right: Values, g_right: Values
) -> Bool[Array, "..."]:
    """True if a minimum of the distance lies between two points, by values and slopes there."""
    falls, grows = g_left < 0, g_right > 0
    return jnp.where(grows, falls | (d_right < d_left), falls & (d_right > d_left))


def _from_centre(track: Track | Near, centre: Points, x: Values) -> tuple[Values, Values]:
    """Distance of the ground at x from the wheel's centre [m], and half the slope of its square."""
    f, df, _ = track.profile(x)
    across, up = x - centre[..., 0], f - centre[..., 1]
    return jnp.sqrt(across**2 + up**2), across + up * df


def dot(a: Points, b: Points) -> Values:
    """Scalar product of vectors [..., 2]."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def cross(a: Points, b: Points) -> Values:
    """z component of the vector product of vectors [..., 2]."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


METHODS = ("newton", "scan")
MOST_ITERATIONS = 100
MOST = 10_000
"""Samples, candidates or fixed iterations that may be asked for."""
TOLERANCES = "None, or a number, 0 < it <= 0.1"


@dataclass(frozen=True)
class PoseSolver:
    """Solver of the rear contact; static, so that only what is asked for is compiled.

    method: "newton", Newton's method kept inside a bracket, for ground that is nowhere hollower
    than the wheel (else the status says HOLLOW_GROUND); or "scan", which looks at `candidates`
    intervals of the bracket for crossings and takes the nearest one behind the front wheel where
    the wheel clears the ground, so that ditches and steps sharper than the wheel are passed, too.
    tolerance: relative error of the wheelbase at which the iteration stops; None: rounding. One
    Newton step follows in any case. iterations: a fixed number of them instead, unrolled; faster
    for batches on ground that is known to be gentle.
    samples: points of each wheel, the body and each leg at which the ground is looked up for
    HOLLOW_GROUND and the clearance; 0 leaves both out (clearance is then infinite). Under the
    wheels it is looked up only where the ground's own numbers do not prove it gentler than the
    wheel everywhere (`nowhere_hollow`), with the same status.
    candidates: intervals for "scan".
    overlap: let the wheels overlap, as in the chapter, to compare with it. No vehicle can stand so.
    wheel_clearance is then infinite.
    """

    method: str = "newton"
    tolerance: float | None = None
    iterations: int | None = None
    samples: int = 16
    candidates: int = 64
    overlap: bool = False

    def __post_init__(self):
        require_choice("method", self.method, METHODS)
        if self.tolerance is not None:
            rule = {"low": 0.0, "high": 0.1, "strict": True, "accepted": TOLERANCES}
            require_one("tolerance", self.tolerance, **rule)
        for name, low in (("iterations", 1), ("samples", 0), ("candidates", 2)):
            if getattr(self, name) is not None or name != "iterations":
                require_integer(name, getattr(self, name), low=low, high=MOST)
        require_kind("overlap", self.overlap, bool, "True or False")
        if self.method == "scan" and self.samples == 0:
            raise ValueError("samples = 0 is not accepted with method = 'scan'; accepted: >= 1")

    def gap(self, dtype: DTypeLike, roundings: int) -> float:
        """Relative error that counts as none: `tolerance`, or so many roundings if that is more."""
        return max(self.tolerance or 0.0, roundings * float(jnp.finfo(dtype).eps))


NEWTON = PoseSolver()
"""The default."""


class Chord(NamedTuple):
    """The wheelbase between the front centre and the rear one's path, in the ground's frame [m]."""

    ground: Near
    radius: Values | float
    centre: Points
    """Centre of the front wheel [m]."""
    wheelbase: Values

    def miss(self, x: Values) -> tuple[Values, Values]:
        """Residual of the wheelbase for a wheel at x [m] (eq. 39), and its slope in x [-]."""
        rear = contact(self.ground, x, self.radius)
        between = rear.centre - self.centre
        distance = jnp.sqrt(dot(between, between))
        safe = jnp.where(distance > 0, distance, 1)
        # The centre moves by tangent * stretch for each metre of ground, which is tangent_x of x.
        rate = dot(between, rear.tangent) * rear.stretch / rear.tangent[..., 0] / safe
        return distance - self.wheelbase, rate


def locate(
    track: Near, radius: Values | float, front: WheelContact, wheelbase: Values, solver: PoseSolver
) -> tuple[Values, Values, Values]:
    """The rear contact [m], by how much the wheelbase is missed there [m] and its slope in x [-].

    In the frame of the track's base. The distance between the centres is at least the wheelbase R
    at x = s_f - R - r and 0 at the front contact, so a crossing lies between. Derivatives are those
    of the last Newton step from a fixed point: the implicit function theorem.
    """
    chord = Chord(track, radius, front.centre, wheelbase)
    low = front.centre[..., 0] - wheelbase - radius
    find = _newton if solver.method == "newton" else _scan
    x = jax.lax.stop_gradient(find(*jax.lax.stop_gradient((chord, front, low)), solver))
    gap, rate = chord.miss(x)
    step = jnp.where(rate == 0, 0, gap / jnp.where(rate == 0, 1, rate))
    polished = x - jnp.clip(step, -radius, radius)
    return polished, *chord.miss(polished)


def _newton(chord: Chord, front: WheelContact, low: Values, solver: PoseSolver) -> Values:
    """Newton's method from the chord along the front tangent, halving where it would not do."""
    high = front.x
    guess = jnp.clip(front.x - chord.wheelbase * front.tangent[..., 0], low, high)
    if solver.iterations is None:
        return _refine(chord, (low, high), guess, solver)
    for _ in range(solver.iterations):
        guess, low, high, _ = _narrowed(chord, guess, low, high)
    return guess


def _narrowed(
    chord: Chord, x: Values, far: Values, near: Values
) -> tuple[Values, Values, Values, Values]:
    """Newton's point if it lies in the bracket, else its middle; the bracket; the miss at x."""
    gap, rate = chord.miss(x)
    far, near = jnp.where(gap > 0, x, far), jnp.where(gap > 0, near, x)
    newton = x - gap / rate
    inside = (newton - far) * (newton - near) <= 0
    return jnp.where(inside, newton, (far + near) / 2), far, near, gap


def _refine(
    chord: Chord, bracket: tuple[Values, Values], guess: Values, solver: PoseSolver
) -> Values:
    """Narrow the bracket (missing by more than 0, by less) until the wheelbase is met."""
    size = size_near(chord.ground, chord.wheelbase, chord.radius)
    stop = solver.gap(chord.wheelbase.dtype, 4) * size

    def narrow(carry: tuple[jax.Array | int, Search]) -> tuple[jax.Array | int, Search]:
        count, (x, far, near, before, done) = carry
        following, far, near, gap = _narrowed(chord, x, far, near)
        slow = jnp.abs(gap) > before / 2  # then the middle is next
        following = jnp.where(slow, (far + near) / 2, following)
        done |= (jnp.abs(gap) <= stop) | (jnp.abs(far - near) <= stop / 8)
        before = jnp.where(slow, jnp.inf, jnp.abs(gap))
        return count + 1, (jnp.where(done, x, following), far, near, before, done)

    done = jnp.zeros(jnp.shape(guess), bool)
    start = (guess, *bracket, jnp.full_like(guess, jnp.inf), done)
    _, found = jax.lax.while_loop(
        lambda carry: (carry[0] < MOST_ITERATIONS) & ~jnp.all(carry[1][-1]), narrow, (0, start)
    )
    return found[0]


def _scan(chord: Chord, front: WheelContact, low: Values, solver: PoseSolver) -> Values:
    """The nearest crossing behind the front wheel where the wheel clears the ground.

    Every interval in which the miss changes sign is refined. Where the ground enters the wheel at
    all of them, the nearest is returned, and the status tells.
    """
    n, track, radius = solver.candidates, chord.ground, chord.radius
    part = jnp.arange(n + 1, dtype=chord.wheelbase.dtype) / n
    knots = low[..., None] + part * (front.x - low)[..., None]
    R = chord.wheelbase[..., None]
    each = chord._replace(centre=chord.centre[..., None, :], wheelbase=R)
    gap = each.miss(knots)[0]
    left, right = knots[..., :-1], knots[..., 1:]
    crossing = (gap[..., :-1] > 0) != (gap[..., 1:] > 0)
    falls = gap[..., :-1] > 0
    bracket = jnp.where(falls, left, right), jnp.where(falls, right, left)
    x = _refine(each, bracket, (left + right) / 2, solver)
    rear = contact(track, x, radius)
    deep = depth_allowed(size_near(track, R, radius))
    clear = (penetration(track, rear, radius, solver.samples) <= deep) & (rear.stretch > 0)
    nearest = jnp.max(jnp.where(crossing, x, low[..., None]), axis=-1)
    best = jnp.max(jnp.where(crossing & clear, x, -jnp.inf), axis=-1)
    return jnp.where(jnp.isfinite(best), best, nearest)


def size_near(ground: Near, wheelbase: Values, radius: Values | float) -> Values:
    """The largest number [m] whose rounding a vehicle's place carries: its own size, wherever on
    the ground it stands; of the shape of wheelbase."""
    grain = ground.grain
    more = (1,) * (jnp.ndim(wheelbase) - grain.ndim)
    return wheelbase + 2 * radius + jnp.reshape(grain, (*grain.shape, *more))


def depth_allowed(size: Float[Array | np.ndarray, "..."]) -> Float[Array | np.ndarray, "..."]:
    """Apparent penetration by rounding [m], at numbers of `size`."""
    return 256 * jnp.finfo(size.dtype).eps * size
