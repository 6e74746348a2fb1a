"""Solving the body equations with the crank's and the foot's motion given.

Unit solutions: everything that the robot needs for a unit of crank acceleration, crank rate
squared, foot acceleration and gravity. Three eliminations, from the paper's to the finest:
one matrix of 71; one of 33 for each leg; a leg's Assur groups one after the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import lu_factor, lu_solve

from stickslip.dynamics.biped.body_equations import (
    CRANK,
    FOOT,
    BodyEquations,
    cross,
    ground_balance,
)
from stickslip.dynamics.biped.joints import (
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

    from stickslip.dynamics.biped.link_motion import LinkMotion

DENSE = ("lu", "scaled", "refined")
"""Solvers of the whole matrix."""

BLOCKS = ("block", "groups")
"""Solvers that take the legs by themselves."""

LEG_BODIES = np.array([[body_of(link, leg) for link in LEG_LINKS] for leg in (0, 1)], np.int32)
"""[2, 11]: indices in BODIES of each leg's own links."""


class UnitSolutions(NamedTuple):
    """Per unit of crank acceleration, crank rate squared, foot acceleration and gravity."""

    joint_forces: Float[Array, "68 4"]
    torque: Float[Array, " 4"]
    ground: Float[Array, "3 4"]
    """Friction, normal force, moment about the ankle."""


def unit_solutions(
    equations: BodyEquations, motion: LinkMotion, length: Float[Array, ""], solver: str
) -> UnitSolutions:
    """Joint forces, torque and ground force for each column of the loads; solver out of BLOCKS.

    length [m]: makes moments comparable with forces; the crank's.
    """
    ground = ground_balance(equations, motion)
    wrenches = jnp.einsum("bij,jk->bik", equations.ground, ground)
    loads = (equations.loads - wrenches)[LEG_BODIES]
    legs = _legs_whole(equations, loads, length) if solver == "block" else _legs(motion, loads)
    return _crank(equations, motion, jnp.concatenate([*legs]), ground)


def leg_matrices(equations: BodyEquations, length: Float[Array, ""]) -> Float[Array, "2 33 33"]:
    """Each leg's own 33 equations in its 33 joint forces; moments per `length` [-]."""
    per_row = _row_scale(length)
    blocks = [
        equations.forces[LEG_BODIES[leg], :, leg_columns(leg)] / per_row[:, None] for leg in (0, 1)
    ]
    return jnp.stack([block.reshape(33, 33) for block in blocks])


def solve_dense(matrix, right, *, refine: bool):
    """LU with partial pivoting; refine: one step of iterative refinement in the same precision."""
    factors = lu_factor(matrix)
    solution = lu_solve(factors, right)
    if refine:
        solution = solution + lu_solve(factors, right - matrix @ solution)
    return solution


def _row_scale(length):
    one = jnp.ones_like(length)
    return jnp.stack([one, one, length])


def _legs_whole(equations: BodyEquations, loads, length):
    """Both legs' joint forces [2, 33, 4] by one LU each."""
    right = (loads / _row_scale(length)[:, None]).reshape(2, 33, loads.shape[-1])
    return jax.vmap(lambda a, b: solve_dense(a, b, refine=False))(
        leg_matrices(equations, length), right
    )


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
    """Of the inner force on the first link."""


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


def _legs(motion: LinkMotion, loads):
    """Both legs' joint forces [2, 33, 4], group by group; loads [2, 11, 3, 4].

    A pair (i, j) with inner pin k and outer pins a, b: the moments of i about a and of j about b
    are two equations in the force at k. The stabiliser: moments about its pin give the slot's force. The
    outer forces then balance. The divisor, (k - a) x (k - b), vanishes only where the group is
    stretched, its dead position.
    """
    joints = {(on, by): place for on, by, place in (*LEG_PINS, LEG_SLOT)}
    at = {joint: place_of(motion.pins, motion.hip_pins, place) for joint, place in joints.items()}
    centres = motion.centres[LEG_BODIES]
    normal = slot_normal(motion.hip_pins)
    forces: dict[tuple[int, int], Array] = {}

    def moment(arm, force):
        return arm[:, 0, None] * force[:, 1] - arm[:, 1, None] * force[:, 0]

    def remaining(link: _Link):
        """Force and moment about its outer pin that a link still needs: [2, 2, 4], [2, 4]."""
        place = LEG_LINKS.index(link.link)
        load, about = loads[:, place], at[link.outer]
        force = load[:, :2]
        turn = load[:, 2] + moment(centres[:, place] - about, force)
        for on, by, sign in link.known:
            given = sign * forces[on, by]
            force = force - given
            turn = turn - moment(at[on, by] - about, given)
        return force, turn

    for group in _PLAN:
        needs = [remaining(link) for link in group.links]
        arms = [at[group.inner] - at[link.outer] for link in group.links]
        (_, first), (_, last) = needs[0], needs[-1]
        if len(group.links) == 1:  # arm x normal * size = first
            size = group.inner_sign * first / cross(arms[0], normal)[:, None]
            forces[group.inner] = size[:, None]
            push = [group.inner_sign * normal[:, None] * size[:, None]]
        else:  # arm_0 x force = first, arm_1 x (-force) = last
            span = cross(arms[0], arms[1])[:, None, None]
            inner = (
                arms[1][..., None] * first[:, None] + arms[0][..., None] * last[:, None]
            ) / span
            forces[group.inner] = group.inner_sign * inner
            push = [inner, -inner]
        for link, (force, _), given in zip(group.links, needs, push, strict=True):
            forces[link.outer] = link.outer_sign * (force - given)
    ordered = sorted(forces, key=lambda joint: pin_columns(*joint).start)
    return jnp.concatenate([forces[joint] for joint in ordered], axis=1)


def _crank(equations: BodyEquations, motion: LinkMotion, legs, ground) -> UnitSolutions:
    """The motor's axis and torque from the crank's three equations, the legs' forces given."""
    rest = equations.loads[CRANK] - equations.forces[CRANK, :, : legs.shape[0]] @ legs
    axis = rest[:2]
    arm = motion.hip_pins[0] - motion.centres[CRANK]
    torque = rest[2] - (arm[0] * axis[1] - arm[1] * axis[0])
    return UnitSolutions(jnp.concatenate([legs, axis]), torque, ground)
