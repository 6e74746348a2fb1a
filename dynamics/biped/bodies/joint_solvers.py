"""Solving the body equations with the crank's and the foot's motion given.

Unit solutions: everything that the robot needs for a unit of crank acceleration, crank rate
squared, foot acceleration and gravity. From the chapter's elimination to the finest: one matrix of
71; one of 33 for each leg; a leg's Assur groups one after the other, which takes no matrix.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.bodies.body_equations import (
    CRANK,
    FOOT,
    BodyEquations,
    cross,
    ground_balance,
)
from stickslip.dynamics.biped.bodies.whole_system import (
    FRICTION,
    TORQUE,
    WHOLE,
    all_columns,
    foot_moment,
    own_rows,
    solve_dense,
    solve_whole,
    unknown_columns,
)
from stickslip.dynamics.biped.mechanism.joints import (
    GROUPS,
    LEG_LINKS,
    LEG_PINS,
    LEG_SLOT,
    body_of,
    leg_columns,
    pin_columns,
    place_of,
    slot_normal,
)

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.mechanism.link_motion import LinkMotion
    from stickslip.dynamics.biped.params import BipedParams

SOLVERS = (*WHOLE, "block", "groups")
"""Accepted names: WHOLE's; "block": each leg's 33 equations by themselves; "groups": each leg's
Assur groups one after the other.

In single precision all give joint forces to about 2e-6 of the largest (median; the linkage's own
rounding is most of it), and "groups" depends on no unit of length, while "lu" loses up to 4e-4 with
lengths of a thousandth. "groups" calls no linear algebra package and in a batch is ten to thirty
times faster than a whole matrix. The others call LAPACK; several
batched factorisations in one program were seen to wait for each other for ever on two cores
(jaxlib 0.10.2)."""

LEG_BODIES = np.array([[body_of(link, leg) for link in LEG_LINKS] for leg in (0, 1)], np.int32)
"""[2, 11]: indices in BODIES of each leg's own links."""


class UnitSolutions(NamedTuple):
    """Per unit of crank acceleration, crank rate squared, foot acceleration and gravity."""

    joint_forces: Float[Array, "68 *columns"]
    torque: Float[Array, "*columns"]
    ground: Float[Array, "3 *columns"]
    """Friction, normal force, moment about the ankle."""


def unit_solutions(
    params: BipedParams, equations: BodyEquations, motion: LinkMotion, solver: str
) -> UnitSolutions:
    """Joint forces, torque and ground force for each column of the loads; solver out of SOLVERS."""
    if solver in WHOLE:
        return _whole(params, equations, solver)
    ground = ground_balance(equations, motion)
    wrenches = jnp.einsum("bij,jk->bik", equations.ground, ground)
    loads = (equations.loads - wrenches)[LEG_BODIES]
    length = jnp.asarray(params.crank)
    legs = _legs_whole(equations, loads, length) if solver == "block" else _legs(motion, loads)
    return _crank(equations, motion, jnp.concatenate([*legs]), ground)


def solution_of(
    params: BipedParams,
    equations: BodyEquations,
    motion: LinkMotion,
    solver: str,
    u: Float[Array, " 4"],
) -> UnitSolutions:
    """Joint forces [68], torque and ground force [3] of one motion u = (alpha, w^2, a1, g)."""
    alone = equations._replace(loads=(equations.loads @ u)[..., None])
    found = unit_solutions(params, alone, motion, solver)
    return UnitSolutions(*(part[..., 0] for part in found))


def leg_matrices(equations: BodyEquations, length: Float[Array, ""]) -> Float[Array, "2 33 33"]:
    """Each leg's own 33 equations in its 33 joint forces; moments per `length` [-]."""
    per_row = _row_scale(length)
    blocks = [
        equations.forces[LEG_BODIES[leg], :, leg_columns(leg)] / per_row[:, None] for leg in (0, 1)
    ]
    return jnp.stack([block.reshape(33, 33) for block in blocks])


def _whole(params: BipedParams, equations: BodyEquations, solver: str) -> UnitSolutions:
    """Solve the matrix of 71 unknowns (eq. 31) with four right sides."""
    system = "inverse_ground"
    matrix = unknown_columns(all_columns(equations, system, 0.0), system)
    right = own_rows(equations.loads, system)
    solution = solve_whole(params, matrix, right, system, solver)
    forces, torque, ground = solution[:TORQUE], solution[TORQUE], solution[FRICTION:]
    moment = foot_moment(equations, equations.loads[FOOT, 2], forces, ground)
    return UnitSolutions(forces, torque, jnp.concatenate([ground, moment[None]]))


def _row_scale(length: Float[Array, ""]) -> Float[Array, " 3"]:
    one = jnp.ones_like(length)
    return jnp.stack([one, one, length])


def _legs_whole(
    equations: BodyEquations, loads: Float[Array, "2 11 3 k"], length: Float[Array, ""]
) -> Float[Array, "2 33 k"]:
    """Both legs' joint forces [2, 33, k] by one LU each."""
    right = (loads / _row_scale(length)[:, None]).reshape(2, 33, loads.shape[-1])
    return jax.vmap(solve_dense)(leg_matrices(equations, length), right)


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
