"""Joint forces by Newton's and Euler's equations of the 24 bodies (eqs. 17-25, 29), group by group.

A joint force acts on body `on` and comes from body `by`; the reverse acts on `by` (Newton's third
law, first lines of eq. 18). Pins take both components in ground axes, slots one normal to the slot.
The equations are solved with the crank's and the foot's motion given, a leg's Assur groups one
after the other, which takes no matrix and no linear algebra package.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.inertia import (
    DifferencedInertia,
    GroundMoment,
    Inertia,
    ReducedInertia,
    body_masses,
)
from stickslip.dynamics.biped.links import BODIES, LINK_OF_BODY, centres_and_angles, kinematics
from stickslip.dynamics.pytrees import pytree_dataclass, same_rank

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.links import LegPins
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.pytrees import Scalar

    Pin = tuple[int, int]
    """Link that a joint force acts on, and link that it comes from."""
    Places = tuple[Float[Array, "24 2"], Float[Array, " 24"]]
    """Of the bodies' centres, and their angles, or derivatives of both."""

LEG_LINKS = (1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12)
"""The 11 links that each leg has of its own."""

LEG_PINS = (
    *((1, 2, "E"), (1, 11, "ankle_bar"), (2, 3, "K"), (2, 5, "K")),
    *((5, 11, "knee_bar"), (5, 12, "knee_bar"), (10, 12, "C_bar"), (7, 3, "C"), (7, 10, "C")),
    *((3, 6, "F"), (6, 13, "D"), (4, 13, "D"), (4, 2, "H")),
    *((7, 8, "crank_pin"), (7, 9, "rod_pin"), (9, 13, "B")),
)
"""Pins of a leg: link `on`, link `by`, and the place: a field of LegPins, or the hip's B or D."""

LEG_SLOT = (10, 13, "slot_pin")
"""The stabiliser's pin P in the hip's slot, which is parallel to A B."""

LEG_JOINTS = (*LEG_PINS, LEG_SLOT)

GROUPS = ((1, 11), (5, 12), (10,), (2, 4), (3, 6), (7, 9))
"""A leg's Assur groups from the foot to the crank: each one's joint forces follow from those of the
groups before it. A pair has a pin between its links and one to the rest of the robot on each; the
stabiliser has a pin and the slot."""


def _body_of(link: int, leg: int) -> int:
    """Index in BODIES of a link of leg 0 (supporting) or 1; crank and hip belong to either."""
    return BODIES.index(str(link) if leg == 0 or link in (8, 13) else f"{link}p")


JOINT_FORCES: tuple[tuple[str, str, str], ...] = tuple(
    (BODIES[_body_of(on, leg)], BODIES[_body_of(by, leg)], axis)
    for leg in (0, 1)
    for on, by, place in (*LEG_JOINTS, *[(8, 13, "axis")] * leg)
    for axis in (("normal",) if place == "slot_pin" else ("x", "y"))
)
"""Names of the 68 components: force on body `on` by body `by`, and the axis. Supporting leg (16
pins, slot), other leg (the same), motor's axis. x and y are ground axes; "normal" is along the
slot's normal, A B turned by +90 degrees (upwards, but for the hip's tilt of a tenth of a degree).
"""

FOOT, CRANK = _body_of(1, 0), _body_of(8, 0)
"""Indices in BODIES of the supporting foot and the crank."""
LEG_BODIES = np.array([[_body_of(link, leg) for link in LEG_LINKS] for leg in (0, 1)], np.int32)
"""[2, 11]: indices in BODIES of each leg's own links."""
ALPHA, SQUARE, SLIDE, GRAVITY = range(4)
"""Columns of loads: unit crank acceleration, crank rate squared, foot acceleration, gravity."""


def link_motion(params: BipedParams, theta: Scalar, difference_step: float | None = None):
    """Motion of all links at crank angle `theta` [rad] of the supporting leg.

    Centres of mass [24, 2] [m] and angles [24] [rad] modulo 2 pi, bodies in the order of BODIES;
    then their first, then their second derivatives by the crank angle. Ground frame, origin at the
    supporting ankle; the slide x1 of eq. 16 is not included. difference_step None: exact, by
    differentiating the closed linkage forwards twice. A number D [rad]: the chapter's forward
    differences. Positions are exact at `theta` either way. Static choice; scalars, batch with vmap.
    """
    if difference_step is not None:
        return _differences(params, theta, difference_step)
    one = jnp.ones_like(theta)

    def slope(angle: Scalar):
        return jax.jvp(lambda at: centres_and_angles(params, at), (angle,), (one,))

    (places, slopes), (_, curvatures) = jax.jvp(slope, (theta,), (one,))
    return places, slopes, curvatures


def _differences(params: BipedParams, theta: Scalar, step: float):
    """Eqs. (23)-(25) with D = `step` [rad], first order in D.

    q' = (q(theta + D) - q(theta)) / D and q'' = (q(theta + 2D) - 2 q(theta + D) + q(theta)) / D^2;
    the chapter prints q(theta) for q(theta + D) in the second. Rounding adds about eps/D^2 to q'':
    in single precision more than 10 % of it at D = 1e-3.
    """
    now, ahead, further = (centres_and_angles(params, theta + shift * step) for shift in (0, 1, 2))
    first = jax.tree.map(_change, now, ahead)
    second = jax.tree.map(_change, ahead, further)
    slopes = jax.tree.map(lambda change: change / step, first)
    return now, slopes, jax.tree.map(lambda a, b: (b - a) / step**2, first, second)


def _change(before: Float[Array, "..."], after: Float[Array, "..."]) -> Float[Array, "..."]:
    """Difference; of angles, the array of rank 1, by the shorter way round."""
    change = after - before
    return change if change.ndim > 1 else change - 2 * np.pi * jnp.round(change / (2 * np.pi))


class _Loaded(NamedTuple):
    """The bodies and pins at one crank angle, and what the bodies' motion takes."""

    centres: Float[Array, "24 2"]
    pins: LegPins
    hip_pins: Float[Array, "3 2"]
    loads: Float[Array, "24 3 k"]


def _loads(
    params: BipedParams, places: Places, slopes: Places, curvatures: Places
) -> Float[Array, "24 3 4"]:
    """Mass times acceleration (x, y) and I times turning acceleration of unit crank acceleration,
    crank rate squared and foot acceleration; minus the weight of unit gravity (eq. 18)."""
    mass, inertia = body_masses(params)[:, None], jnp.asarray(params.inertia)[LINK_OF_BODY]

    def of(centres: Float[Array, "24 2"], angles: Float[Array, " 24"]) -> Float[Array, "24 3"]:
        return jnp.concatenate([mass * centres, (inertia * angles)[:, None]], axis=1)

    nowhere, still = jax.tree.map(jnp.zeros_like, places)
    units = (jnp.asarray(row, nowhere.dtype) for row in np.eye(2)[:, None])
    slides = (of(nowhere + unit, still) for unit in units)
    return jnp.stack([of(*slopes), of(*curvatures), *slides], axis=-1)


def _ground_balance(at: _Loaded) -> Float[Array, "3 k"]:
    """Friction, normal force and moment about the ankle, per column of loads (eqs. 29-30).

    The sum of all bodies' equations, moments about the ankle: joint forces and torque cancel. The
    ankle is taken at ground level.
    """
    moments = at.loads[:, 2] + _moment(at.centres - at.pins.E[:1], at.loads[:, :2])
    return jnp.sum(jnp.stack([at.loads[:, 0], at.loads[:, 1], moments], axis=1), axis=0)


@pytree_dataclass
class JointInertia(Inertia):
    """Inertia functions by solving the body equations for unit motions at every call.

    difference_step: None for exact motion of the links, or the chapter's D [rad] (eqs. 23-25);
    static, with which `at` gives DifferencedInertia. Agrees with `reduced_inertia` to rounding when
    exact. Neglected: friction in the joints.
    """

    params: BipedParams
    difference_step: float | None = field(default=None, metadata={"static": True})

    def at(self, theta: Scalar) -> ReducedInertia | DifferencedInertia:
        _, torque, (friction, normal, _) = _solution(self._loaded(theta))
        six = ReducedInertia(
            M=torque[ALPHA],
            dM=2 * torque[SQUARE],
            P=friction[ALPHA],
            dP=friction[SQUARE],
            Y=normal[ALPHA],
            dY=normal[SQUARE],
        )
        if self.difference_step is None:
            return six
        return DifferencedInertia(*six, P_crank=torque[SLIDE], Y_crank=torque[GRAVITY])

    def moment_at(self, theta: Scalar) -> GroundMoment:
        moment = _ground_balance(self._loaded(theta))[2]
        return GroundMoment(moment[ALPHA], moment[SQUARE], moment[GRAVITY], -moment[SLIDE])

    def joint_forces(
        self,
        theta: Scalar,
        crank_rate: Scalar,
        crank_acceleration: Scalar,
        foot_acceleration: Scalar,
    ) -> Float[Array, " 68"]:
        """All joint forces [N] of a motion, in the order of JOINT_FORCES."""
        at = self._loaded(theta)
        gravity = jnp.asarray(self.params.gravity, jnp.result_type(crank_rate))
        u = jnp.stack([crank_acceleration, crank_rate**2, foot_acceleration, gravity])
        return _solution(at._replace(loads=(at.loads @ u)[..., None]))[0][:, 0]

    def _loaded(self, theta: Scalar) -> _Loaded:
        motion = link_motion(self.params, theta, self.difference_step)
        now = kinematics(self.params, theta)
        return _Loaded(motion[0][0], now.pins, now.hip_pins, _loads(self.params, *motion))


def _solution(at: _Loaded) -> tuple[Array, Array, Array]:
    """Joint forces [68, k], motor torque [k] and ground force and moment [3, k] of the loads."""
    ground, loads = _ground_balance(at), at.loads
    to_ankle = at.pins.E[0] - at.centres[FOOT]
    turn = ground[2] + to_ankle[0] * ground[1] - to_ankle[1] * ground[0]
    foot = loads[FOOT] - jnp.stack([ground[0], ground[1], turn])
    legs = _legs(at, jnp.concatenate([foot[None], loads[FOOT + 1 :]])[LEG_BODIES])
    crank, centre = loads[CRANK], at.centres[CRANK]
    pushes = legs[7, 8]  # on the rods; the reverse on the crank
    axis = crank[:2] + jnp.sum(pushes, axis=0)
    turns = jnp.sum(_moment(at.pins.crank_pin - centre[None], pushes), axis=0)
    arm = at.hip_pins[0] - centre
    torque = crank[2] + turns - (arm[0] * axis[1] - arm[1] * axis[0])
    ordered = jnp.concatenate([legs[on, by] for on, by, _ in LEG_JOINTS], axis=1)
    return jnp.concatenate([*ordered, axis]), torque, ground


def _legs(motion: _Loaded, loads: Float[Array, "2 11 3 k"]) -> dict[Pin, Array]:
    """Force in every joint of both legs [2, components, k], group by group from the foot."""
    hip = {name: jnp.stack([p, p]) for name, p in zip("ABD", motion.hip_pins, strict=True)}
    places = motion.pins._asdict() | hip
    at = {(on, by): places[place] for on, by, place in LEG_JOINTS}
    centres = motion.centres[LEG_BODIES]
    along = motion.hip_pins[1] - motion.hip_pins[0]
    normal = jnp.stack([-along[1], along[0]]) / jnp.sqrt(along @ along)
    forces: dict[Pin, Array] = {}
    for links in GROUPS:
        unsolved = [j for j in at if set(j) & set(links) and j not in forces]
        between = next(j for j in unsolved if set(j) == set(links) or j == LEG_SLOT[:2])
        outer = [next(j for j in unsolved if link in j and j != between) for link in links]
        known = at, centres, loads, forces
        needs = [_remaining(link, pin, *known) for link, pin in zip(links, outer, strict=True)]
        arms = [at[between] - at[pin] for pin in outer]
        inner = _inner_force(arms, [turn for _, turn in needs], normal)
        for sign, link, pin, (force, _) in zip((1, -1), links, outer, needs, strict=False):
            forces[pin] = _sign(pin, link) * (force - sign * inner)
        if between == LEG_SLOT[:2]:
            inner = jnp.sum(normal[None, :, None] * inner, axis=1, keepdims=True)
        forces[between] = _sign(between, links[0]) * inner
    return forces


def _sign(pin: Pin, link: int) -> int:
    """+1 if the force of a joint acts on the link, -1 if it comes from it."""
    return 1 if pin[0] == link else -1


def _remaining(
    link: int,
    outer: Pin,
    at: dict[Pin, Float[Array, "2 2"]],
    centres: Float[Array, "2 11 2"],
    loads: Float[Array, "2 11 3 k"],
    forces: dict[Pin, Array],
) -> tuple[Float[Array, "2 2 k"], Float[Array, "2 k"]]:
    """Force and moment about its outer pin that a link still needs: [2, 2, k], [2, k]."""
    place = LEG_LINKS.index(link)
    load, about = loads[:, place], at[outer]
    force = load[:, :2]
    turn = load[:, 2] + _moment(centres[:, place] - about, force)
    for pin in at:
        if link in pin and pin in forces:
            given = _sign(pin, link) * forces[pin]
            force = force - given
            turn = turn - _moment(at[pin] - about, given)
    return force, turn


def _inner_force(
    arms: list[Float[Array, "2 2"]], turns: list[Float[Array, "2 k"]], normal: Float[Array, " 2"]
) -> Float[Array, "2 2 k"]:
    """Force on a group's first link in its inner joint [2, 2, k], from moments about outer pins.

    A pair: arm_1 x force = turn_1, arm_2 x (-force) = turn_2; the divisor vanishes only where the
    pair is stretched, its dead position. The stabiliser: arm x normal * size = turn.
    """
    if len(arms) == 1:
        return normal[None, :, None] * (turns[0] / _cross(arms[0], normal)[:, None])[:, None]
    (arm, other), (turn, back) = arms, turns
    span = _cross(arm, other)[:, None, None]
    return (other[..., None] * turn[:, None] + arm[..., None] * back[:, None]) / span


def _cross(a: Float[Array, "*#n 2"], b: Float[Array, "*#n 2"]) -> Float[Array, "..."]:
    """Cross product a_x b_y - a_y b_x in the plane, of vectors whose batches broadcast."""
    ax, ay, bx, by = same_rank(a[..., 0], a[..., 1], b[..., 0], b[..., 1])
    return ax * by - ay * bx


def _moment(arm: Float[Array, "n 2"], force: Float[Array, "n 2 k"]) -> Float[Array, "n k"]:
    """arm x force for arm [n, 2] and force [n, 2, k]."""
    return arm[:, 0, None] * force[:, 1] - arm[:, 1, None] * force[:, 0]
