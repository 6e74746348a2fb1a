"""A walk as rows with units, and in a few numbers."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import JOINT_FORCES, floor_position
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.compilation import run_once
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import centre_of_mass
from stickslip.records.table import Column, Table
from stickslip.simulate.output import STATUS

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.simulate.walk import Walk


FALLS = ("TOPPLE", "LIFT_OFF")
WHOLE = ("OK", "SLIP_ONSET", "STEP_COMPLETE")
"""Statuses of a walk that came to the end of what was asked."""
NO_WAY = 0.1
"""Of a step: below it nothing is said per metre."""


def walk_table(walk: Walk) -> Table:
    """A row for the start and one for the end of every period, numbers as they were computed.

    torque: held from there on (in the last row: up to there). Forces: at the end of the period that
    ends there. slid: the foot's path during it, either direction; foot position: how far it has
    slid in all, forwards positive. What belongs to the period before is empty in the first row.
    """
    states, torques, contacts = (
        getattr(walk.trajectory, name) for name in ("states", "torques", "contacts")
    )
    ankle, mass = _places(walk)
    at_ends: dict[Column, object] = {
        Column("time", "s"): states.time,
        Column("torque", "N m"): [*torques, *(torques[-1:] if len(torques) else [None])],
        Column("phase", "rad"): states.phase,
        Column("steps"): states.steps,
        Column("crank angle", "rad"): states.phase + np.pi * states.steps,
        Column("crank rate", "rad/s"): states.crank_rate,
        Column("foot position", "m"): states.foot_position,
        Column("foot velocity", "m/s"): states.foot_velocity,
        Column("ankle on the floor", "m"): ankle,
        Column("centre of mass", "m"): mass,
    }
    of_periods: dict[Column, object] = {
        Column("friction force", "N"): contacts.friction_force,
        Column("normal force", "N"): contacts.normal_force,
        Column("zero-moment point", "m"): contacts.zmp,
        Column("mode"): contacts.mode,
        Column("slid", "m"): contacts.slide_distance,
        Column("switches"): contacts.switches,
        Column("work", "J"): contacts.work,
        Column("positive work", "J"): contacts.positive_work,
    }
    if contacts.joint_forces is not None:
        forces = np.asarray(contacts.joint_forces).T
        of_periods |= {
            Column(str(name), "N"): one for name, one in zip(JOINT_FORCES, forces, strict=True)
        }
    columns = [np.asarray(values).tolist() for values in at_ends.values()]
    columns += [[None, *np.asarray(values).tolist()] for values in of_periods.values()]
    columns.append([None, *(Status(int(code)).name for code in contacts.status)])
    heads = [*at_ends, *of_periods, Column("status", words=True)]
    return Table(heads, list(zip(*columns, strict=True)))


def event_table(walk: Walk) -> Table:
    """A row a switching instant."""
    heads = [Column("time", "s"), Column("event", words=True), Column("crank_angle", "rad")]
    return Table(heads, walk.events)


def meaning_of(walk: Walk, steps: int = 0, distance: float = 0.0) -> str:
    """Text of the walk's end; of a torque that is not a number: which, when, at what crank rate."""
    meaning = STATUS[walk.status.name]
    if walk.status <= Status.SLIP_ONSET and (steps == 0 or distance < 0):
        place = f"ended {abs(distance):.3g} m {'behind' if distance < 0 else 'ahead'}"
        took = "took no step" if steps == 0 else STATUS["OK"]
        return f"{took}, {place}{meaning.removeprefix(STATUS['OK'])}"
    if walk.status.name != "NON_FINITE" or np.isfinite(walk.torque):
        return meaning
    end = walk.trajectory.final
    time, angle, rate = map(float, (end.time, end.crank_angle, end.crank_rate))
    return (
        f"the torque is {walk.torque:g} at {time:.6g} s, where the crank angle is {angle:.4g} rad "
        f"and its rate {rate:.4g} rad/s"
    )


def walk_summary(walk: Walk, seconds: float) -> Table:
    """One row. distance: of the centre of mass. slid: the foot's path, either direction; slide: how
    far it is displaced, forwards positive. slips: how often it broke loose. energy_per_metre: of
    walks of at least NO_WAY of a step. seconds: asked for."""
    states, contacts = walk.trajectory.states, walk.trajectory.contacts
    time, angle = (float(v[-1] - v[0]) for v in (states.time, states.phase))
    angle += np.pi * float(states.steps[-1] - states.steps[0])
    mass = _places(walk)[1]
    distance = float(mass[-1] - mass[0])
    slid, work, positive = (
        float(np.sum(of, dtype=np.float64))
        for of in (contacts.slide_distance, contacts.work, contacts.positive_work)
    )
    kinds = Counter(kind for _, kind, _ in walk.events)
    steps = int(states.steps[-1] - states.steps[0])
    went = distance >= NO_WAY * float(walk.robot.step_length)
    fell = walk.status.name in FALLS
    row: dict[Column, object] = {
        Column("status", words=True): walk.status.name,
        Column("meaning", words=True): meaning_of(walk, steps, distance),
        Column("asked", "s"): float(seconds),
        Column("time", "s"): time,
        Column("distance", "m"): distance,
        Column("mean_speed", "m/s"): distance / time if time else None,
        Column("mean_crank_rate", "rad/s"): angle / time if time else None,
        Column("steps"): steps,
        Column("slid", "m"): slid,
        Column("slide", "m"): float(states.foot_position[-1] - states.foot_position[0]),
        Column("slips"): kinds["slip"],
        Column("work", "J"): work,
        Column("positive_work", "J"): positive,
        Column("energy_per_metre", "J/m"): positive / distance if went else None,
        Column("falls"): int(fell),
        Column("amplification"): walk.amplification,
    }
    return Table(list(row), [list(row.values())])


def _places(walk: Walk) -> tuple[np.ndarray, np.ndarray]:
    """The supporting ankle and the centre of mass along the floor, at every state [m]."""
    with precision(walk.dtype):
        ankle, mass = _along(walk.robot, jax.tree.map(jnp.asarray, walk.trajectory.states))
        return np.asarray(ankle), np.asarray(mass)


@run_once
def _along(robot: BipedModel, states: BipedState) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    nought = jnp.zeros((), jnp.int32)
    mass = jax.vmap(lambda state: centre_of_mass(robot, state, nought))(states)
    return floor_position(robot, states), mass
