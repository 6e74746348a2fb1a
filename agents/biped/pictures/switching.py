"""When a walk's foot broke loose, stuck, handed over or crossed an edge, inside control steps.

An episode keeps states at the ends of control steps. Each step in which something switched is taken
again from its own first state by the episode's own integrator, which writes down the instants that
it splits the step at; nothing runs on from one step to the next.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.drive import Torque
from stickslip.dynamics.biped.simulation import stepped
from stickslip.dynamics.biped.stepping.integrators import EventExact, RK4Split
from stickslip.dynamics.scene import Smoothed
from stickslip.dynamics.status import EventKind
from stickslip.envs.biped.draw import drawn_robot, drawn_scene

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.dynamics.biped.fidelity import Fidelity
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.biped.stepping.integrators import Integrator
    from stickslip.dynamics.scene import Scene
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState

BLOCK = 32
"""Control steps that one call takes again."""
BRIEF = 1e-6
"""A slide, or a stop, that is over sooner is none [s]."""
LOCATED = "99 of 100 were within 0.1 ms of event_exact's"
"""How exact the instants of steps of 20 ms are; docs/viewer.md says where that was measured."""


class Switch(NamedTuple):
    """What happened. time: since the episode's start [s]. step: the control step, 1 for the first.
    way: of a slip 1 forwards, -1 backwards; of an exchange 1 a step on, -1 one back; else 0."""

    time: float
    kind: EventKind
    step: int
    way: int = 0


def switches_of(
    played: Rollout[BipedEnvState], env: BipedEnv, params: BipedEnvParams
) -> list[Switch]:
    """The switches of one trimmed episode in their order; on a smoothed floor, which knows no rest,
    those of the support alone.

    Where the replay of a step does not end as the step did (sliding or at rest, after as many
    steps), what changed is told for the step's end.
    """
    states, period = _with_start(played), float(params.control_period)
    steps, slide = (np.asarray(getattr(states.biped, n)) for n in ("steps", "foot_position"))
    velocity = np.asarray(states.biped.foot_velocity, float)
    if isinstance(params.scene.floor, Smoothed):
        velocity = np.zeros_like(velocity)
    busy = (np.asarray(played.info["slid"]) != 0) | (velocity[1:] != velocity[:-1])
    busy |= steps[1:] != steps[:-1]
    found: list[Switch] = []
    where = np.flatnonzero(busy)
    for index, log in zip(where, _logs(where, states, played, env, params), strict=True):
        ways = np.sign(velocity[index + 1]), np.sign(slide[index + 1] - slide[index])
        rows = _agreeing(log, velocity[index : index + 2] != 0, steps[index : index + 2], period)
        last = max((i for i, (_, kind) in enumerate(rows) if kind == EventKind.SLIP), default=-1)
        turn = int(np.sign(steps[index + 1] - steps[index]))
        for i, (time, kind) in enumerate(rows):
            slips = int(ways[0] if i == last and ways[0] else ways[1])
            way = {EventKind.SLIP: slips, EventKind.EXCHANGE: turn}.get(kind, 0)
            found.append(Switch(float(index * period + time), kind, int(index) + 1, way))
    return _without_brief(found)


def accuracy_of(spec: Integrator, period: float) -> str:
    """How exact the instants are, in words."""
    if isinstance(spec, EventExact):
        return f"located to the tolerance of event_exact, {spec.rtol:g}"
    if isinstance(spec, RK4Split):
        size = 1e3 * period / spec.substeps
        return f"as rk4_split with steps of {size:g} ms locates them; of 20 ms {LOCATED}"
    return f"to the integrator's steps of {1e3 * period / spec.substeps:.3g} ms"


def sliding_spans(found: Sequence[Switch], end: float) -> np.ndarray:
    """From when to when the foot slid [k, 2] s; end: of the episode."""
    spans: list[list[float]] = []
    for one in found:
        if one.kind == EventKind.SLIP and (not spans or spans[-1][1] < end):
            spans.append([one.time, end])
        elif one.kind == EventKind.STICK and spans:
            spans[-1][1] = one.time
    return np.array(spans, np.float32).reshape(-1, 2)


def _with_start(played: Rollout[BipedEnvState]) -> BipedEnvState:
    """The states with the first before them, every leaf [n + 1]."""
    return jax.tree.map(
        lambda first, rest: np.concatenate([np.asarray(first)[None], np.asarray(rest)]),
        played.start_state,
        played.state,
    )


def _logs(
    where: np.ndarray,
    states: BipedEnvState,
    played: Rollout[BipedEnvState],
    env: BipedEnv,
    params: BipedEnvParams,
) -> Iterator[list[tuple[float, EventKind]]]:
    """What the integrator writes down in each of these control steps: instants since its start."""
    spec, drawn = replace(env.integrator, record_events=True), played.start_state.drawn
    robot, scene = drawn_robot(drawn, params), drawn_scene(drawn, params)
    for first in range(0, len(where), BLOCK):
        block = where[first : first + BLOCK]
        filled = np.concatenate([block, np.repeat(block[-1:], BLOCK - len(block))])
        before = jax.tree.map(lambda leaf, at=filled: leaf[at], states.biped)
        torque = np.asarray(played.info["torque"])[filled]
        period = np.asarray(params.control_period, torque.dtype)
        found = _logged(spec, env.fidelity, robot, scene, before, torque, period)
        times, kinds = jax.device_get(found)
        for row in range(len(block)):
            yield [
                (float(time), EventKind(int(kind)))
                for time, kind in zip(times[row], kinds[row], strict=True)
                if kind != EventKind.NONE
            ]


@partial(jax.jit, static_argnums=(0, 1))
def _logged(
    spec: Integrator,
    fidelity: Fidelity,
    robot: BipedModel,
    scene: Scene,
    states: BipedState,
    torques: Array,
    period: Array,
):
    """One program for all episodes of a kind of floor and load, whatever else a task draws."""

    def one(state: BipedState, torque: Array):
        begun = replace(state, time=jnp.zeros_like(state.crank_rate))
        _, contact = stepped(spec, fidelity, robot, scene, begun, Torque(torque), period)
        log = contact.events
        return (log.times, log.kinds) if log is not None else ()  # it is: spec records them

    return jax.vmap(one)(states, torques)


def _agreeing(
    log: list[tuple[float, EventKind]], slides: np.ndarray, steps: np.ndarray, period: float
) -> list[tuple[float, EventKind]]:
    """A log with what is missing from it at the step's end; slides, steps: before and after."""
    now = bool(slides[0])
    for _, kind in log:
        now = {EventKind.SLIP: True, EventKind.STICK: False}.get(kind, now)
    if now != slides[1]:
        log = [*log, (period, EventKind.SLIP if slides[1] else EventKind.STICK)]
    turns = abs(int(steps[1] - steps[0]))
    if sum(kind == EventKind.EXCHANGE for _, kind in log) != turns:
        log = [one for one in log if one[1] != EventKind.EXCHANGE]
        log += [(period, EventKind.EXCHANGE)] * turns
    return log


def _without_brief(found: list[Switch]) -> list[Switch]:
    """Less slides and stops that are over at once; a foot that turns back slips the other way."""
    pairs = ((EventKind.SLIP, EventKind.STICK), (EventKind.STICK, EventKind.SLIP))
    kept: list[Switch] = []
    for one in found:
        before = kept[-1] if kept else None
        if before and (before.kind, one.kind) in pairs and one.time - before.time < BRIEF:
            kept.pop()
            if one.kind == EventKind.STICK:
                continue
        kept.append(one)
    return kept
