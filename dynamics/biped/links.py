"""Positions of the 24 links as functions of the supporting leg's crank angle (eqs. 3-16).

Hip frame: origin A, x from A to B, y up. Ground frame: origin at the supporting ankle, x forwards
and parallel to the foot, y up. The supporting foot is flat, so the hip turns by -theta10 (eq. 11).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete
from stickslip.dynamics.pytrees import float_type, require_broadcast, run_once, same_rank

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.pytrees import Number, Numeric, Scalar

Linkage = Any
"""A BipedParams: its module imports this one."""

BODIES = (*(str(n) for n in range(1, 14)), *(f"{n}p" for n in range(1, 13) if n != 8))
"""The 24 bodies in order: links 1-13 (supporting leg, crank, hip), then the swing leg's 11 (p)."""

SUPPORT_START = np.pi / 2
"""Crank angle [rad] at which a leg begins to carry the weight."""
SUPPORT_END = 3 * np.pi / 2
"""Crank angle [rad] at which the other leg takes over."""
MISMATCH = 1e-4
"""`exchange_mismatch` below which an exchange counts as free of impact. Lengths of single precision
have up to 2e-6 where it is computed in float64."""

# int32: JAX 0.10 cannot index with NumPy's int64 in float32 once the same shapes ran in float64
LINK_OF_BODY = np.array([int(name.rstrip("p")) - 1 for name in BODIES], np.int32)
_SWING = np.array([number - 1 for number in range(1, 13) if number != 8], np.int32)


class LegPins(NamedTuple):
    """One leg's pin positions, each [2] m; `Kinematics.pins` stacks both legs: [2, 2]."""

    crank_pin: Array
    rod_pin: Array
    C: Array
    F: Array
    K: Array
    H: Array
    E: Array
    slot_pin: Array
    ankle_bar: Array
    """E + d"""
    knee_bar: Array
    """K + d"""
    C_bar: Array
    """C + d"""


class Kinematics(NamedTuple):
    """Positions in the ground frame for one crank angle; bodies in the order of BODIES."""

    centres: Float[Array, "24 2"]
    """Centres of mass [m]."""
    angles: Float[Array, " 24"]
    """Link angles from the horizontal [rad], continuous modulo 2 pi."""
    pins: LegPins
    """Pins of both legs, each [2, 2] m, supporting leg first."""
    hip_pins: Float[Array, "3 2"]
    """A, B and D [m]."""
    closure: Scalar
    """Least closing margin of the loops [-]: negative where the linkage cannot close."""


class _Leg(NamedTuple):
    origins: Float[Array, "13 2"]
    directions: Float[Array, "13 2"]
    pins: LegPins
    closure: Scalar


@run_once
def kinematics(params: Linkage, theta: Real[Number, ""]) -> Kinematics:
    """All 24 links for crank angle `theta` [rad] of the supporting leg (eqs. 3-11, MODEL 1.1-1.2).

    Closed form: the loops are closed by intersecting circles on the chapter's branches (knee
    forwards), so lengths are free as long as `closure` >= 0. Ground frame; the slide x1 of eq. 16
    is not included. Differentiable in theta and params. Scalars: batch with vmap.
    """
    support, swing = _legs(params, theta)
    centres, angles = _bodies(params, support, swing)
    pins = jnp.stack([jnp.stack(support.pins), jnp.stack(swing.pins)], axis=1)
    hip = jnp.stack(_hip_pins(params, jnp.zeros_like(support.pins.E[0])))
    return Kinematics(
        centres=centres,
        angles=angles,
        pins=LegPins(*_from_ankle(support, pins)),
        hip_pins=_from_ankle(support, hip),
        closure=jnp.minimum(support.closure, swing.closure),
    )


def centres_and_angles(
    params: Linkage, theta: Real[Number, ""]
) -> tuple[Float[Array, "24 2"], Float[Array, " 24"]]:
    """Centres of mass [m] and link angles [rad] alone of `kinematics`."""
    return _bodies(params, *_legs(params, theta))


def closing_margin(params: Linkage, theta: Real[Number, ""]) -> Scalar:
    """Least closing margin of the loops [-] at one crank angle [rad], as `Kinematics.closure`."""
    support, swing = _legs(params, theta)
    return jnp.minimum(support.closure, swing.closure)


def step_length(params: Linkage) -> Scalar:
    """Distance from one foothold to the next without slip [m]: 8 crank lengths by default."""
    support, swing = _legs(params, jnp.asarray(SUPPORT_END, float_type(params)))
    return _to_ground(support, swing.pins.E - support.pins.E)[0]


@run_once
def exchange_mismatch(params: Linkage) -> Scalar:
    """Deviation of the exchange of support from impact-free [-]; 0 for a symmetric Chebyshev curve.

    The largest, over both ends of the support phase, of the other foot's height over the ground and
    velocity (per crank rate) in crank lengths, its angle and its turning rate (per crank rate); or
    the crank's own centre of mass off its axis, in crank lengths, since the arms change places.
    """

    def other_foot(theta: Scalar) -> Float[Array, " 3"]:
        support, swing = _legs(params, theta)
        ankle = _to_ground(support, swing.pins.E - support.pins.E)
        along, up = _to_ground(support, swing.directions[0])
        return jnp.stack([*(ankle / params.crank), jnp.arctan2(up, along)])

    def mismatch(theta: Scalar) -> Scalar:
        place, rate = jax.jvp(other_foot, (theta,), (jnp.ones_like(theta),))
        return jnp.max(jnp.abs(jnp.stack([place[1], place[2], *rate])))

    ends = jnp.asarray([SUPPORT_START, SUPPORT_END], float_type(params))
    unbalance = jnp.max(jnp.abs(jnp.asarray(params.centre)[7])) / params.crank
    return jnp.maximum(jnp.max(jax.vmap(mismatch)(ends)), unbalance)


def as_batch(params: Any) -> tuple[tuple[int, ...], Any]:
    """The batch's shape, () for one robot, and every field as an array with its axes first."""
    leaves, structure = jax.tree.flatten(params)
    fields = zip(vars(params), leaves, PLAIN_NDIM, strict=True)
    cuts = {name: (np.shape(of), np.ndim(of) - n) for name, of, n in fields}
    batch = require_broadcast(**{k: np.broadcast_to(0, of[:cut]) for k, (of, cut) in cuts.items()})
    whole = [
        jnp.broadcast_to(jnp.asarray(leaf), batch + shape[cut:])
        for leaf, (shape, cut) in zip(leaves, cuts.values(), strict=True)
    ]
    return batch, structure.unflatten(whole)


def require_closure(params: Linkage) -> None:
    """Raise ValueError naming a crank angle at which the linkage cannot close, if any."""
    if not is_concrete(params):
        return
    batch, whole = as_batch(params)
    count, depth, dtype = int(np.prod(batch)), len(batch), float_type(whole)
    # of one type, and none of them weak: else the check is compiled for each combination
    flat = jax.tree.map(lambda of: np.asarray(of, dtype).reshape(count, *of.shape[depth:]), whole)
    margin, angles = map(np.asarray, _closure_margins(flat))
    if np.all(margin >= 0):
        return
    member = int(np.argmin(np.nan_to_num(margin, nan=-np.inf)))
    angle = float(angles[member] % (2 * np.pi))
    of = f" (batch member {member})" if batch else ""
    raise ValueError(
        f"the linkage cannot close at crank angle {angle:.4f} rad ({np.degrees(angle):.1f} degrees)"
        f"{of}: closing margin {margin[member]:.3g}; accepted: lengths whose loops close, "
        "with margin >= 0, at every crank angle"
    )


_closure_margins = run_once(jax.vmap(lambda member: least_closure(member, 720)))
"""Per member: the least closing margin, and the crank angle [rad] it belongs to."""


def least_closure(params: Linkage, samples: int):
    """Least closing margin over the whole turn, and its crank angle [rad].

    Sampled, then 64 times finer around the worst sample: the margin has no second minimum
    between two samples, and its error falls with the square of the finer spacing.
    """
    dtype = float_type(params)

    def margins(angles: Float[Array, " n"]) -> Float[Array, " n"]:
        return jax.vmap(lambda angle: _leg(params, angle).closure)(angles)

    spacing = 2 * np.pi / samples
    coarse = jnp.asarray(np.arange(samples) * spacing, dtype)
    worst = coarse[jnp.nanargmin(margins(coarse))]
    near = worst + jnp.asarray(np.linspace(-spacing, spacing, 2 * 64 + 1), dtype)
    margin = margins(near)
    place = jnp.nanargmin(margin)
    return margin[place], near[place]


PLAIN_NDIM = [0] * 17 + [1, 2, 1] + [0, 0]
"""Axes of BipedParams' fields, in order, without a batch."""


def _legs(params: Linkage, theta: Number) -> tuple[_Leg, _Leg]:
    """Supporting and swinging leg in the hip frame: one leg, shifted by half a turn (eq. 10)."""
    both = jax.vmap(lambda angle: _leg(params, angle))(jnp.stack([theta, theta + np.pi]))
    return tuple(jax.tree.map(lambda leaf, i=i: leaf[i], both) for i in range(2))


def _bodies(params: Linkage, support: _Leg, swing: _Leg):
    """Centres of mass [m] and angles [rad] of the 24 bodies in the ground frame."""
    origins = jnp.concatenate([support.origins, swing.origins[_SWING]])
    directions = jnp.concatenate([support.directions, swing.directions[_SWING]])
    directions = _to_ground(support, directions)
    normals = jnp.stack([-directions[:, 1], directions[:, 0]], axis=-1)
    local = jnp.asarray(params.centre)[LINK_OF_BODY]
    centres = _from_ankle(support, origins)
    centres = centres + local[:, :1] * directions + local[:, 1:] * normals
    return centres, jnp.arctan2(directions[:, 1], directions[:, 0])


def _from_ankle(support: _Leg, points: Float[Array, "*any 2"]) -> Float[Array, "*any 2"]:
    """Points of the hip frame in the ground frame, whose origin is the supporting ankle."""
    points, ankle = same_rank(points, support.pins.E)
    return _to_ground(support, points - ankle)


def _to_ground(support: _Leg, vectors: Float[Array, "*any 2"]) -> Float[Array, "*any 2"]:
    """Hip frame to ground frame: the supporting foot lies along x (eq. 11)."""
    c, s = support.directions[0]  # e(theta10): the foot's direction seen from the hip
    x, y = vectors[..., 0], vectors[..., 1]
    return jnp.stack([c * x + s * y, c * y - s * x], axis=-1)


def _leg(params: Linkage, angle: Scalar) -> _Leg:
    """One leg and the hip in the hip frame, for its own crank angle."""
    zero = jnp.zeros_like(angle)
    A, B, D = _hip_pins(params, zero)
    ahead = jnp.stack([zero + 1, zero])

    crank = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
    crank_pin = params.crank * crank
    # eq. (3): the rocker's pin on the rod, below the line from the crank pin to B
    rod_pin, margin_rod = _meet(crank_pin, B, params.rod_pin, params.rocker)
    rod = (crank_pin - rod_pin) / params.rod_pin
    C = crank_pin - params.rod * rod
    # eq. (4): F ahead of the line from D to C, so that the knee bends forwards
    F, margin_knee = _meet(D, C, params.upper_tendon, params.femur_pin)
    femur = (C - F) / params.femur_pin
    K = C - params.femur * femur
    # the pantograph's fourth corner H, on the other side of the line from D to K than F
    H, margin_tibia = _meet(D, K, params.lower_tendon, params.tibia_pin)
    tibia = (K - H) / params.tibia_pin
    E = K - params.tibia * tibia
    # eq. (5) with 4.2 for the printed 24: P slides along the slot
    sine = (-params.slot_depth - C[1]) / params.stabiliser
    margin_slot = 1 - sine**2
    foot = jnp.stack([_root(margin_slot), sine])
    P = C + params.stabiliser * foot
    d = params.offset * foot

    origins = [E, E, K, H, K, D, C, A, rod_pin, C, E + d, K + d, A]
    upper_tendon = (F - D) / params.upper_tendon
    lower_tendon = (D - H) / params.lower_tendon
    rocker = (B - rod_pin) / params.rocker
    directions = [foot, tibia, femur, lower_tendon, foot, upper_tendon, rod]
    directions += [crank, rocker, foot, tibia, femur, ahead]
    pins = LegPins(crank_pin, rod_pin, C, F, K, H, E, P, E + d, K + d, C + d)
    margins = jnp.stack([margin_rod, margin_knee, margin_tibia, margin_slot])
    return _Leg(jnp.stack(origins), jnp.stack(directions), pins, jnp.min(margins))


def _hip_pins(params: Linkage, zero: Scalar) -> tuple[Array, Array, Array]:
    """A, B and D in the hip frame [m]; zero: in the working precision."""
    A, B = jnp.stack([zero, zero]), jnp.stack([zero + params.ground_link, zero])
    return A, B, jnp.stack([zero + params.ground_link, zero - params.tendon_drop])


def _meet(
    p: Float[Array, " 2"], q: Float[Array, " 2"], from_p: Numeric, from_q: Numeric
) -> tuple[Float[Array, " 2"], Scalar]:
    """The point at the given distances from p and q, right of the way from p to q.

    Also the closing margin: the squared height of the triangle over its base squared, which is
    negative where the circles do not meet (the point is then the nearest on the line p q).
    """
    base = q - p
    square = base @ base
    along = (from_p**2 - from_q**2 + square) / (2 * square)
    margin = from_p**2 / square - along**2
    normal = jnp.stack([-base[1], base[0]])
    return p + along * base - _root(margin) * normal, margin


def _root(square: Scalar) -> Scalar:
    """Square root, 0 below 0, with a finite derivative everywhere."""
    inside = square > 0
    return jnp.where(inside, jnp.sqrt(jnp.where(inside, square, 1.0)), 0.0)
