"""A walk piece by piece, so that its length is bounded by a disk's room and not by a program's."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import (
    BipedModel,
    BipedParams,
    BipedState,
    Trajectory,
    prepare,
    simulate,
)
from stickslip.dynamics.biped.params import own_time
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.biped.walk_check import nudged, separation
from stickslip.dynamics.checks import require_memory, require_number
from stickslip.dynamics.status import Status
from stickslip.simulate.torque import Expression, Recorded

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.dynamics import Scene, Setting
    from stickslip.optim.progress import Bar

PIECE = 500
"""The most periods of one program's run."""
BYTES = 3000
"""Of a row, while it is a row of a table."""
SHORTEST, LONGEST = 1e-6, 1e7
"""Seconds of a walk."""


@dataclass(frozen=True)
class Walk:
    """Simulated walk as NumPy arrays: states [n + 1], torques and contacts [n].

    status: the gravest one met. events: (time [s], kind, crank angle [rad]) in their order. period:
    between two states [s]. torque: held when it ended [N m]. A period that ends NON_FINITE is left
    out: its numbers are none. amplification: how many times a small difference of the start grew
    along the walk, by a second walk that begins beside it (see `separation`).
    """

    robot: BipedModel
    trajectory: Trajectory
    events: list[tuple[float, str, float]]
    status: Status
    torque: float
    period: float
    dtype: str
    amplification: float

    @property
    def count(self) -> int:
        """Number of simulated periods."""
        return len(self.trajectory.torques)


def periods(seconds: float, period: float) -> tuple[int, float]:
    """Number and length [s] of a walk's periods; ValueError for more than memory holds."""
    accepted = f"from {SHORTEST:g} to {LONGEST:g} s"
    for name, value in (("--seconds", seconds), ("--period", period)):
        require_number(name, value, low=SHORTEST, high=LONGEST, accepted=accepted)
    require_memory(
        f"--seconds {seconds:g} with --period {period:g}", "rows", seconds / period, BYTES
    )
    count = max(1, math.ceil(seconds / period * (1 - 1e-6)))  # a file may be in single precision
    return count, seconds / count


def walked(
    params: BipedParams,
    scene: Scene,
    state: BipedState,
    torque: float | Expression | Recorded,
    seconds: float,
    period: float,
    setting: Setting,
    bar: Bar,
) -> Walk:
    """Walk; see `simulate` for what is refused. The torque is held for each period: that of its
    beginning. bar: told of periods."""
    count, size = periods(seconds, period)
    pieces = math.ceil(count / PIECE)
    each = math.ceil(count / pieces)
    starts = np.arange(each * pieces + 1) * size + float(np.asarray(state.time))
    law, values = (0.0, torque) if isinstance(torque, Recorded) else (torque, None)
    held = None if values is None else values.over(starts, count)
    integrator = replace(setting.integrator_over(size), record_events=True)
    with precision(setting.dtype):
        params, scene = _cast((params, scene), setting.dtype)
        robot = prepare(params, fidelity=setting.fidelity, payload=scene.payload)
        scene, state = replace(scene, payload=None), state.astype(setting.dtype)

        def walk(now: BipedState):
            parts: list[Trajectory] = []
            last: tuple[int, float] | None = None
            for piece in range(pieces):
                here = slice(piece * each, (piece + 1) * each)
                given = law if held is None else jnp.asarray(held[here], setting.dtype)
                part = simulate(robot, scene, now, given, each * size, size, integrator=integrator)
                part, last = _trimmed(part, count - piece * each)
                parts.append(part)
                time = np.asarray(starts[(piece + 1) * each], setting.dtype)  # counted
                now = replace(part.final, time=time)
                bar.advance(len(part.torques))
                if last is not None:
                    break
            return _joined(parts), last, [event for part in parts for event in part.events()]

        whole, last, events = walk(state)
        beside = walk(nudged(state, params.crank, own_time(params)))[0]
        grown = _amplification(whole, beside, params.crank)
    code, held_last = last or (np.max(whole.contacts.status), whole.torques[-1])
    status, torque_last = Status(int(code)), float(held_last)
    return Walk(robot, whole, events, status, torque_last, size, setting.dtype, grown)


def _amplification(one: Trajectory, other: Trajectory, length: Array) -> float:
    """The largest of `separation` while both are inside the model."""
    inside = [int(np.sum(walk.contacts.status <= Status.SLIP_ONSET)) for walk in (one, other)]
    row, row_beside = (
        jax.tree.map(lambda leaf: leaf[: min(inside) + 1], walk.states) for walk in (one, other)
    )
    return float(np.max(separation(row, row_beside, length)))


def _cast(parts: tuple[BipedParams, Scene], dtype: str) -> tuple[BipedParams, Scene]:
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), parts)


def _trimmed(part: Trajectory, most: int) -> tuple[Trajectory, tuple[int, float] | None]:
    """Simulated part of a piece, as NumPy arrays, and, where the walk ends in it, the status
    of that and the torque [N m]."""
    part = jax.tree.map(np.asarray, part)
    ended = np.flatnonzero(part.contacts.status[:most] > Status.SLIP_ONSET)
    keep, last = min(most, len(part.torques)), None
    if ended.size:
        end = int(ended[0])
        last = int(part.contacts.status[end]), float(part.torques[end])
        keep = end + (last[0] != Status.NON_FINITE)
    states = jax.tree.map(lambda leaf: leaf[: keep + 1], part.states)
    contacts = jax.tree.map(lambda leaf: leaf[:keep], part.contacts)
    return Trajectory(states, part.torques[:keep], contacts), last


def _joined(parts: list[Trajectory]) -> Trajectory:
    """One after the other; each begins in the state that the one before it ends in."""
    first, *rest = (part.states for part in parts)
    states = [first, *(jax.tree.map(lambda leaf: leaf[1:], one) for one in rest)]
    torques, contacts = (
        [getattr(part, name) for part in parts] for name in ("torques", "contacts")
    )
    return Trajectory(*(jax.tree.map(_end_to_end, *each) for each in (states, torques, contacts)))


def _end_to_end(*leaves: np.ndarray) -> np.ndarray:
    return np.concatenate(leaves)
