"""A walk under a torque: simulated, as rows with units, and in a few numbers."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene, Setting, biped
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.checks import require_memory, require_number
from stickslip.dynamics.pytrees import run_once
from stickslip.dynamics.scene import Floor
from stickslip.dynamics.status import Status
from stickslip.envs.biped.picture import under_foot
from stickslip.envs.biped.state import centre_of_mass
from stickslip.optim.gait.footing import Footing, Need
from stickslip.records.table import Column, Table
from stickslip.report import one_row
from stickslip.simulate.torque import Expression, PhaseRates, Rate, Recorded, rates_at

if TYPE_CHECKING:
    from jaxtyping import Array, Float

BYTES = 3000
"""Memory of a row of a table."""
NO_LIMITS: Mapping[str, float] = {}
SHORTEST, LONGEST = 1e-6, 1e7
"""Seconds of a walk."""
WHOLE = ("OK", "SLIP_ONSET")
"""Statuses of a walk that came to the end of what was asked."""
SHORT = 0.1
"""Share of a step below which no energy per metre is given."""


class Rates(NamedTuple):
    """The crank's motion is given."""

    rate: Rate


Torque = float | Expression | Recorded


class Along(NamedTuple):
    """Numbers at every state of a walk, each [n + 1]; NaN where there is no friction. ankle, mass:
    places of the supporting ankle and of the centre of mass along the floor [m]. momentum:
    P(theta) x crank rate [kg m/s]."""

    ankle: np.ndarray
    mass: np.ndarray
    momentum: np.ndarray
    mu_static: np.ndarray
    mu_kinetic: np.ndarray


@dataclass(frozen=True)
class Walk:
    """Simulated walk as NumPy arrays: states [n + 1], torques and contacts [n].

    scene: without the payload, which is the robot's. period: between two states [s]; where the walk
    ends early, the last one is nearer. status: the gravest one of the walk. A period that ends
    NON_FINITE is left out: its numbers are none. law: where the crank's motion is given;
    the torques are then those at the periods' ends.
    """

    robot: biped.BipedModel
    scene: Scene
    trajectory: biped.Trajectory
    period: float
    status: Status
    along: Along
    law: Rate | None = None

    @property
    def count(self) -> int:
        """Number of simulated periods."""
        return len(self.trajectory.torques)


def periods(seconds: float, period: float) -> tuple[int, float]:
    """Number and length [s] of a walk's periods; ValueError for more than memory holds."""
    accepted = f"from {SHORTEST:g} to {LONGEST:g} s"
    for name, value in (("--seconds", seconds), ("--period", period)):
        require_number(name, value, low=SHORTEST, high=LONGEST, accepted=accepted)
    given = f"--seconds {seconds:g} with --period {period:g}"
    require_memory(given, "rows", seconds / period, BYTES)
    count = max(1, math.ceil(seconds / period * (1 - 1e-6)))  # a file may be in single precision
    return count, seconds / count


def walked(
    params: biped.BipedParams,
    scene: Scene,
    state: biped.BipedState,
    law: Torque | Rates,
    seconds: float,
    period: float,
    setting: Setting,
    motor: Mapping[str, float] = NO_LIMITS,
) -> Walk:
    """Walk; see `simulate` for what is refused. The torque of a period's beginning is held; crank
    rates are straight between the ends of periods. motor: numbers of a robot's file; a torque
    beyond torque_limit [N m] or max_power [W] saturates, a given rate beyond them is refused."""
    count, size = periods(seconds, period)
    times = np.arange(count + 1) * size + float(np.asarray(state.time))
    walks: Callable[..., biped.Trajectory] = biped.simulate
    values: Any = law.at(times[:-1]) if isinstance(law, Recorded) else law
    limit, max_power = motor.get("torque_limit", np.inf), motor.get("max_power")
    if isinstance(law, Rates):
        rates = rates_at(law.rate, times, float(np.asarray(state.phase)))
        state, values = replace(state, crank_rate=rates[0]), np.diff(rates) / size
        walks = biped.simulate_inverse
    elif isinstance(law, Expression):
        values = replace(law, limit=limit)
    else:
        values = np.clip(values, -limit, limit)
    if max_power is not None and walks is biped.simulate:
        walks = partial(biped.simulate, max_power=max_power)
    integrator = replace(setting.integrator_over(size), record_events=True)
    with precision(setting.dtype):
        params, scene = jax.tree.map(lambda of: jnp.asarray(of, setting.dtype), (params, scene))
        robot = biped.prepare(params, fidelity=setting.fidelity, payload=scene.payload)
        scene, state = replace(scene, payload=None), state.astype(setting.dtype)
        held: Any = values if callable(values) else jnp.asarray(values, setting.dtype)
        path = walks(robot, scene, state, held, count * size, size, integrator=integrator)
        whole, status = _trimmed(path)
        found = _along(robot, scene.floor, jax.tree.map(jnp.asarray, whole.states))
    walk = Walk(robot, scene, whole, size, status, Along(*map(np.asarray, found)))
    if not isinstance(law, Rates):
        return walk
    _require_power(walk, limit, max_power)
    return replace(walk, law=law.rate)


def _require_power(walk: Walk, limit: float, max_power: float | None) -> None:
    """Raise ValueError for a given crank motion that the motor cannot give."""
    torques = np.asarray(walk.trajectory.torques, float)
    power = np.abs(torques * walk.trajectory.states.crank_rate[1:])
    given = {"torque_limit": (np.abs(torques), limit, "N m"), "max_power": (power, max_power, "W")}
    for name, (values, most, unit) in given.items():
        if most is not None and np.max(values, initial=0.0) > most:
            accepted = f"at most {name} = {most:g} {unit} of the robot's motor"
            raise ValueError(f"--rate needs {np.max(values):.3g} {unit}; accepted: {accepted}")


def _trimmed(path: biped.Trajectory) -> tuple[biped.Trajectory, Status]:
    """A trajectory up to the period in which it ends, as NumPy arrays, and its status."""
    path = jax.tree.map(np.asarray, path)
    keep, status = len(path.torques), Status(int(np.max(path.contacts.status)))
    ended = np.flatnonzero(path.contacts.status > Status.SLIP_ONSET)
    if ended.size:
        status = Status(int(path.contacts.status[ended[0]]))
        keep = int(ended[0]) + (status != Status.NON_FINITE)
    if keep > 1 and path.states.time[keep] == path.states.time[keep - 1]:  # it ends as it begins
        keep, told = keep - 1, path.contacts.status.copy()
        told[keep - 1] = status
        path = replace(path, contacts=replace(path.contacts, status=told))
    states = jax.tree.map(lambda leaf: leaf[: keep + 1], path.states)
    contacts = jax.tree.map(lambda leaf: leaf[:keep], path.contacts)
    return biped.Trajectory(states, path.torques[:keep], contacts), status


def walk_table(walk: Walk) -> Table:
    """A row for the start and one for the end of every period, numbers as they were computed.

    torque: held from there on (in the last row: up to there), or the mean of that period where the
    motor's power limits it; where the crank's motion is given, what is needed there. Forces: at the
    end of the period that ends there. slid: the foot's path in it, either direction; foot position:
    how far it has slid in all, forwards positive. What belongs to the period before is empty in the
    first row.
    """
    path = walk.trajectory
    states, torques, contacts = path.states, path.torques, path.contacts
    held = [None, *torques] if walk.law is not None else [*torques, *torques[-1:]]
    at_ends: dict[Column, object] = {
        Column("time", "s"): states.time,
        Column("torque", "N m"): held if len(torques) else [None],
        Column("phase", "rad"): states.phase,
        Column("steps"): states.steps,
        Column("crank angle", "rad"): states.phase + np.pi * states.steps,
        Column("crank rate", "rad/s"): states.crank_rate,
        Column("foot position", "m"): states.foot_position,
        Column("foot velocity", "m/s"): states.foot_velocity,
        Column("ankle on the floor", "m"): walk.along.ankle,
        Column("centre of mass", "m"): walk.along.mass,
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
        names = [Column(str(name), "N") for name in biped.JOINT_FORCES]
        of_periods |= zip(names, np.asarray(contacts.joint_forces).T, strict=True)
    columns: dict[Column, list[Any]]
    columns = {name: np.asarray(of).tolist() for name, of in at_ends.items()}
    columns |= {name: [None, *np.asarray(of).tolist()] for name, of in of_periods.items()}
    status = [None, *(Status(int(code)).name for code in contacts.status)]
    return Table.of_columns(columns | {Column("status", words=True): status})


def need_of(held: Walk) -> Need | None:
    """The least friction that holds the foot throughout such a walk; None of none."""
    if not held.count:
        return None
    states = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), held.trajectory.states)
    footing, seconds = Footing.of(held.robot.params), np.maximum(np.diff(states.time), SHORTEST)
    angle, rate = states.phase + np.pi * states.steps, states.crank_rate
    if isinstance(law := held.law, PhaseRates):  # to the same angle in the next step
        turned = np.append(law.angles, law.angles[0] + np.pi)
        return footing.along(turned, np.append(law.rates, law.rates[0]))
    if held.law is not None:
        return footing.accelerated(angle, rate, np.diff(rate) / seconds)
    torque = np.asarray(held.trajectory.torques, np.float64)
    return footing.driven(angle, rate, torque, seconds)


def walk_summary(walk: Walk, held: Walk, seconds: float, efficiency: float | None = None) -> Table:
    """One row. distance: of the centre of mass. slid: the foot's path, either direction; slide: how
    far it is displaced, forwards positive. slips: how often it broke loose. energy_per_metre: of
    walks of at least SHORT of a step. seconds: asked for. least_friction: what holds the foot
    throughout the same walk without slip, `held`; needed_at: the supporting leg's crank angle."""
    states, contacts = walk.trajectory.states, walk.trajectory.contacts
    time, angle = (float(v[-1] - v[0]) for v in (states.time, states.phase))
    angle += np.pi * float(states.steps[-1] - states.steps[0])
    distance = float(walk.along.mass[-1] - walk.along.mass[0])
    parts = contacts.slide_distance, contacts.work, contacts.positive_work
    slid, work, positive = (float(np.sum(of, dtype=np.float64)) for of in parts)
    kinds = Counter(kind for _, kind, _ in walk.trajectory.events())
    steps = int(states.steps[-1] - states.steps[0])
    went = distance >= SHORT * float(walk.robot.step_length)
    need = need_of(held)
    row: dict[Column, object] = {
        Column("status", words=True): walk.status.name,
        Column("asked", "s"): float(seconds),
        Column("time", "s"): time,
        Column("distance", "m"): distance,
        Column("mean_speed", "m/s"): distance / time if time else None,
        Column("mean_crank_rate", "rad/s"): angle / time if time else None,
        Column("steps"): steps,
        Column("slid", "m"): slid,
        Column("net_slide", "m"): float(states.foot_position[-1] - states.foot_position[0]),
        Column("slid_per_step", "m"): slid * np.pi / abs(angle) if steps and angle else None,
        Column("slips"): kinds["slip"],
        Column("least_friction"): need and (need.friction if need.friction < np.inf else None),
        Column("needed_at", "rad"): need and need.crank_angle,
        Column("without_slip", words=True): _held_in_words(held, need),
        Column("work", "J"): work,
        Column("positive_work", "J"): positive,
        Column("work_over_efficiency", "J"): efficiency and positive / efficiency,
        Column("energy_per_metre", "J/m"): positive / distance if went else None,
    }
    return one_row(row)


def _held_in_words(held: Walk, need: Need | None) -> str | None:
    """What the motion without slip does that is no walk of the whole time."""
    if need is not None and need.friction == np.inf:
        return "no friction holds the foot: it leaves the ground"
    if held.status.name in WHOLE:
        return None
    time = float(held.trajectory.states.time[-1] - held.trajectory.states.time[0])
    return f"it ends after {time:.4g} s: {held.status.name}"


@run_once
def _along(
    robot: biped.BipedModel, floor: Floor, states: biped.BipedState
) -> tuple[Float[Array, " n"], ...]:
    nought = jnp.zeros((), jnp.int32)

    def one(state: biped.BipedState) -> tuple[Array, ...]:
        ankle, friction = under_foot(robot, floor, state)
        momentum = robot.inertia.at(state.phase).P * state.crank_rate
        return ankle, centre_of_mass(robot, state, nought), momentum, *friction

    return jax.vmap(one)(states)
