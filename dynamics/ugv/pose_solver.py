"""Finding the rear contact: where the wheel's path meets the circle about the front wheel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import (
    require_integer,
    require_kind,
    require_number,
    shown,
)
from stickslip.dynamics.ugv.ground.near import Near
from stickslip.dynamics.ugv.wheel import WheelContact, contact, dot

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.ugv.ground.shapes import Points, Values

    Search = tuple[Values, Values, Values, Values, Bool[Array, "..."]]
    """The point, the bracket's ends, the miss before, whether it is found."""

MOST_ITERATIONS = 100
MOST = 10_000
"""Samples or fixed iterations that may be asked for."""
TOLERANCES = "None, or one number, 0 < it <= 0.1"


@dataclass(frozen=True)
class PoseSolver:
    """Solver of the rear contact; static, so that only what is asked for is compiled.

    Newton's method kept inside a bracket, for ground that is nowhere hollower than the wheel; else
    the status says HOLLOW_GROUND.
    tolerance: relative error of the wheelbase at which the iteration stops; None: rounding. One
    Newton step follows in any case. iterations: a fixed number of them instead, unrolled; faster
    for batches on ground that is known to be gentle.
    samples: points of each wheel, the body and each leg at which the ground is looked up for
    HOLLOW_GROUND and the clearance; 0 leaves both out (clearance is then infinite). Under the
    wheels it is looked up only where the ground's own numbers do not prove it gentler than the
    wheel everywhere (`nowhere_hollow`), with the same status.
    overlap: let the wheels overlap, as in the chapter, to compare with it. No vehicle can stand so.
    wheel_clearance is then infinite.
    """

    tolerance: float | None = None
    iterations: int | None = None
    samples: int = 16
    overlap: bool = False

    def __post_init__(self):
        if self.tolerance is not None:
            require_number(
                "tolerance", self.tolerance, low=0.0, high=0.1, strict=True, accepted=TOLERANCES
            )
            if np.ndim(self.tolerance):
                raise ValueError(f"tolerance = {shown(self.tolerance)}; accepted: {TOLERANCES}")
        for name, low in (("iterations", 1), ("samples", 0)):
            if getattr(self, name) is not None or name != "iterations":
                require_integer(name, getattr(self, name), low=low, high=MOST)
        require_kind("overlap", self.overlap, bool, "True or False")

    def stop_gap(self, dtype: DTypeLike) -> float:
        """Relative error of the wheelbase at which an adaptive iteration stops."""
        return max(self.tolerance or 0.0, 4 * float(jnp.finfo(dtype).eps))

    def accepted_gap(self, dtype: DTypeLike) -> float:
        """Error relative to the vehicle's size and place above which a pose is NOT_CONVERGED."""
        return max(self.tolerance or 0.0, 64 * float(jnp.finfo(dtype).eps))


NEWTON = PoseSolver()
"""The default."""


class Chord(NamedTuple):
    """The wheelbase between the front centre and the path of the rear one; lengths [m] in the frame
    of the ground's base."""

    ground: Near
    radius: Values | float
    centre: Points
    """Of the front wheel."""
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
    at x = s_f - R - r and 0 at the front contact, so a crossing lies between. Derivatives: the last
    Newton step is differentiated, with the point before it held fixed, which is the implicit
    function theorem.
    """
    chord = Chord(track, radius, front.centre, wheelbase)
    low = front.centre[..., 0] - wheelbase - radius
    x = jax.lax.stop_gradient(_newton(*jax.lax.stop_gradient((chord, front, low)), solver))
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
    """Narrow the bracket (missing by more than 0, by less) until the wheelbase is met.

    Where Newton's method does not at least halve the miss, the next point is the middle.
    """
    size = size_near(chord.ground, chord.wheelbase, chord.radius)
    stop = solver.stop_gap(chord.wheelbase.dtype) * size

    def more(carry: tuple[jax.Array | int, Search]):
        count, (*_, done) = carry
        return (count < MOST_ITERATIONS) & ~jnp.all(done)

    def narrow(carry: tuple[jax.Array | int, Search]) -> tuple[jax.Array | int, Search]:
        count, (x, far, near, before, done) = carry
        following, far, near, gap = _narrowed(chord, x, far, near)
        slow = jnp.abs(gap) > before / 2
        following = jnp.where(slow, (far + near) / 2, following)
        done |= (jnp.abs(gap) <= stop) | (jnp.abs(far - near) <= stop / 8)
        before = jnp.where(slow, jnp.inf, jnp.abs(gap))
        return count + 1, (jnp.where(done, x, following), far, near, before, done)

    done = jnp.zeros(jnp.shape(guess), bool)
    start = (guess, *bracket, jnp.full_like(guess, jnp.inf), done)
    return jax.lax.while_loop(more, narrow, (0, start))[1][0]


def size_near(ground: Near, wheelbase: Values, radius: Values | float) -> Values:
    """The largest number [m] whose rounding a vehicle's place carries: its own size, wherever on
    the ground it stands; of the shape of wheelbase."""
    grain = ground.grain
    more = (1,) * (jnp.ndim(wheelbase) - grain.ndim)
    return wheelbase + 2 * radius + jnp.reshape(grain, (*grain.shape, *more))


def depth_allowed(size: Float[Array | np.ndarray, "..."]) -> Float[Array | np.ndarray, "..."]:
    """Apparent penetration by rounding [m], at numbers of `size`."""
    return 256 * jnp.finfo(size.dtype).eps * size
