"""Fidelity "joint": the reduced equations' coefficients out of the full Newton-Euler system.

The body equations are solved with the crank's and the foot's motion given, for a unit of crank
acceleration, crank rate squared, foot acceleration and gravity each: a leg's Assur groups one after
the other, which takes no matrix and no linear algebra package.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.inertia import GroundMoment, ReducedInertia
from stickslip.dynamics.biped.joints.equations import (
    ALPHA,
    CRANK,
    GRAVITY,
    SLIDE,
    SQUARE,
    body_equations,
    cross,
    ground_balance,
    link_motion,
    require_difference_step,
)
from stickslip.dynamics.biped.joints.pins import (
    GROUPS,
    LEG_LINKS,
    LEG_PINS,
    LEG_SLOT,
    body_of,
    pin_columns,
    place_of,
    slot_normal,
)
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.joints.equations import BodyEquations, LinkMotion
    from stickslip.dynamics.biped.params import BipedParams

LEG_BODIES = np.array([[body_of(link, leg) for link in LEG_LINKS] for leg in (0, 1)], np.int32)
"""[2, 11]: indices in BODIES of each leg's own links."""


class DifferencedInertia(NamedTuple):
    """Coefficients when the links' motion is differenced: the crank's equation has its own.

    T = M alpha + P_crank a1 + dM w^2 / 2 + g Y_crank, f = P alpha + m a1 + dP w^2,
    N = m g + Y alpha + dY w^2. Exactly differentiated, P_crank = P and Y_crank = Y. Here the first
    two are the virtual power of the exact geometry, P and Y the differenced momenta.
    """

    M: Float[Array, ""]
    dM: Float[Array, ""]
    """Twice the coefficient of w^2 in the crank's equation."""
    P: Float[Array, ""]
    dP: Float[Array, ""]
    Y: Float[Array, ""]
    dY: Float[Array, ""]
    P_crank: Float[Array, ""]
    Y_crank: Float[Array, ""]


@register_pytree
@dataclass(frozen=True)
class JointInertia:
    """Inertia functions by solving the body equations for unit motions at every call.

    difference_step: None for exact motion of the links, or the chapter's D [rad] (eqs. 23-25);
    static. Agrees with `reduced_inertia` to rounding when exact.
    """

    params: BipedParams
    difference_step: float | None = field(default=None, metadata={"static": True})

    def __post_init__(self):
        if self.difference_step is not None:
            require_difference_step(self.difference_step)

    def at(self, theta: Float[Array, ""]) -> ReducedInertia | DifferencedInertia:
        """M, P, Y and slopes at `theta` [rad]; DifferencedInertia with a difference_step."""
        units = self.units(theta)
        torque, (friction, normal, _) = units.torque, units.ground
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

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad] (eq. 30)."""
        motion, equations = self._equations(theta)
        moment = ground_balance(equations, motion)[2]
        return GroundMoment(moment[ALPHA], moment[SQUARE], moment[GRAVITY], -moment[SLIDE])

    def spin_at(self, theta: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """L and its slope alone, at `theta` [rad]."""
        return self.moment_at(theta)[:2]

    def joint_forces(
        self,
        theta: Float[Array, ""],
        crank_rate: Float[Array, ""],
        crank_acceleration: Float[Array, ""],
        foot_acceleration: Float[Array, ""],
    ) -> Float[Array, " 68"]:
        """All joint forces [N] of a motion, in the order of JOINT_FORCES."""
        motion, equations = self._equations(theta)
        gravity = jnp.asarray(self.params.gravity, jnp.result_type(crank_rate))
        u = jnp.stack([crank_acceleration, crank_rate**2, foot_acceleration, gravity])
        return solution_of(equations, motion, u).joint_forces

    def units(self, theta: Float[Array, ""]) -> UnitSolutions:
        """Joint forces, torque and ground force per unit of motion and gravity, at `theta`."""
        motion, equations = self._equations(theta)
        return unit_solutions(equations, motion)

    def _equations(self, theta: Float[Array, ""]) -> tuple[LinkMotion, BodyEquations]:
        motion = link_motion(self.params, theta, self.difference_step)
        return motion, body_equations(self.params, motion)


class UnitSolutions(NamedTuple):
    """Per unit of crank acceleration, crank rate squared, foot acceleration and gravity."""

    joint_forces: Float[Array, "68 *columns"]
    torque: Float[Array, "*columns"]
    ground: Float[Array, "3 *columns"]
    """Friction, normal force, moment about the ankle."""


def unit_solutions(equations: BodyEquations, motion: LinkMotion) -> UnitSolutions:
    """Joint forces, torque and ground force for each column of the loads."""
    ground = ground_balance(equations, motion)
    wrenches = jnp.einsum("bij,jk->bik", equations.ground, ground)
    loads = (equations.loads - wrenches)[LEG_BODIES]
    return _crank(equations, motion, jnp.concatenate([*_legs(motion, loads)]), ground)


def solution_of(
    equations: BodyEquations, motion: LinkMotion, u: Float[Array, " 4"]
) -> UnitSolutions:
    """Joint forces [68], torque and ground force [3] of one motion u = (alpha, w^2, a1, g)."""
    alone = equations._replace(loads=(equations.loads @ u)[..., None])
    found = unit_solutions(alone, motion)
    return UnitSolutions(*(part[..., 0] for part in found))


class _Link(NamedTuple):
    """A link of a group: its outer joint, and whether the force's sign there is +1."""

    link: int
    outer: tuple[int, int]
    outer_sign: int
    known: tuple[tuple[int, int, int], ...]
    """Joints solved before, with the sign of their force on this link."""


class _Group(NamedTuple):
    links: tuple[_Link, ...]
    inner: tuple[int, int]
    inner_sign: int
    """Sign of the inner force on the first link."""


def _plan() -> tuple[_Group, ...]:
    """The joints of each group, by the pin table: which is solved where."""
    joints = [(on, by) for on, by, _ in (*LEG_PINS, LEG_SLOT)]
    solved: set[tuple[int, int]] = set()
    groups = []
    for members in GROUPS:
        touching = [joint for joint in joints if set(joint) & set(members)]
        fresh = [joint for joint in touching if joint not in solved]
        inner = next(j for j in fresh if set(j) == set(members) or j == LEG_SLOT[:2])
        links = []
        for link in members:
            sign = {j: 1 if j[0] == link else -1 for j in touching if link in j}
            outer = next(j for j in fresh if link in j and j != inner)
            known = tuple((*j, s) for j, s in sign.items() if j in solved)
            links.append(_Link(link, outer, sign[outer], known))
        groups.append(_Group(tuple(links), inner, 1 if inner[0] == members[0] else -1))
        solved.update(fresh)
    return tuple(groups)


_PLAN = _plan()


def _legs(motion: LinkMotion, loads: Float[Array, "2 11 3 k"]) -> Float[Array, "2 33 k"]:
    """Both legs' joint forces [2, 33, k], group by group from the foot; loads [2, 11, 3, k]."""
    joints = {(on, by): place for on, by, place in (*LEG_PINS, LEG_SLOT)}
    at = {joint: place_of(motion.pins, motion.hip_pins, place) for joint, place in joints.items()}
    centres = motion.centres[LEG_BODIES]
    normal = slot_normal(motion.hip_pins)
    forces: dict[tuple[int, int], Array] = {}
    for group in _PLAN:
        needs = [_remaining(link, at, centres, loads, forces) for link in group.links]
        arms = [at[group.inner] - at[link.outer] for link in group.links]
        inner = _inner_force(arms, [turn for _, turn in needs], normal)
        for sign, link, (force, _) in zip((1, -1), group.links, needs, strict=False):
            forces[link.outer] = link.outer_sign * (force - sign * inner)
        if group.inner == LEG_SLOT[:2]:
            inner = jnp.sum(normal[None, :, None] * inner, axis=1, keepdims=True)
        forces[group.inner] = group.inner_sign * inner
    ordered = sorted(forces, key=lambda joint: pin_columns(*joint).start)
    return jnp.concatenate([forces[joint] for joint in ordered], axis=1)


def _remaining(
    link: _Link,
    at: dict[tuple[int, int], Float[Array, "2 2"]],
    centres: Float[Array, "2 11 2"],
    loads: Float[Array, "2 11 3 k"],
    forces: dict[tuple[int, int], Array],
) -> tuple[Float[Array, "2 2 k"], Float[Array, "2 k"]]:
    """Force and moment about its outer pin that a link still needs: [2, 2, k], [2, k]."""
    place = LEG_LINKS.index(link.link)
    load, about = loads[:, place], at[link.outer]
    force = load[:, :2]
    turn = load[:, 2] + _moment(centres[:, place] - about, force)
    for on, by, sign in link.known:
        given = sign * forces[on, by]
        force = force - given
        turn = turn - _moment(at[on, by] - about, given)
    return force, turn


def _inner_force(
    arms: list[Float[Array, "2 2"]], turns: list[Float[Array, "2 k"]], normal: Float[Array, " 2"]
) -> Float[Array, "2 2 k"]:
    """Force on a group's first link in its inner joint [2, 2, k], from moments about outer pins.

    A pair: arm_1 x force = turn_1, arm_2 x (-force) = turn_2; the divisor vanishes only where the
    pair is stretched, its dead position. The stabiliser: arm x normal * size = turn.
    """
    if len(arms) == 1:
        return normal[None, :, None] * (turns[0] / cross(arms[0], normal)[:, None])[:, None]
    (arm, other), (turn, back) = arms, turns
    span = cross(arm, other)[:, None, None]
    return (other[..., None] * turn[:, None] + arm[..., None] * back[:, None]) / span


def _moment(arm: Float[Array, "2 2"], force: Float[Array, "2 2 k"]) -> Float[Array, "2 k"]:
    """arm x force for arm [2, 2] and force [2, 2, k]."""
    return arm[:, 0, None] * force[:, 1] - arm[:, 1, None] * force[:, 0]


def _crank(
    equations: BodyEquations,
    motion: LinkMotion,
    legs: Float[Array, "66 k"],
    ground: Float[Array, "3 k"],
) -> UnitSolutions:
    """The motor's axis and torque from the crank's three equations, the legs' forces given."""
    rest = equations.loads[CRANK] - equations.forces[CRANK, :, : legs.shape[0]] @ legs
    axis = rest[:2]
    arm = motion.hip_pins[0] - motion.centres[CRANK]
    torque = rest[2] - (arm[0] * axis[1] - arm[1] * axis[0])
    return UnitSolutions(jnp.concatenate([legs, axis]), torque, ground)
