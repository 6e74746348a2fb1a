"""Many walks in one compiled batch, each with its own robot, floor, state, torque and time step.

The extremes are run with it: every case is a row, so that a table of them costs one compilation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene, Status, Uniform
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedModel,
    BipedState,
    Contact,
    step,
)

ROWS = 96
"""Walks go in batches of this size, the last one filled up, so that all share a program."""

Integrator = Any
"""A name or settings that `step` accepts."""


@dataclass(frozen=True)
class Start:
    """One walk: `count` calls of `step` with `dt` [s] under a constant torque [N m].

    mu_kinetic None: as mu_static. model None: the default that `march` is given. The other fields
    are those of BipedState.
    """

    mu_static: float = 1.0
    mu_kinetic: float | None = None
    phase: float = SUPPORT_START
    crank_rate: float = 0.0
    foot_velocity: float = 0.0
    torque: float = 0.0
    dt: float = 0.01
    count: int = 1
    model: BipedModel | None = None


class March(NamedTuple):
    """What came of the walks; every leaf has one entry a walk."""

    state: BipedState
    contact: Contact
    work: Any
    """Of the motor [J]."""
    path: Any
    """Length of the foot's way over the floor [m]."""
    switches: Any
    most_switches: Any
    """In one call."""
    calls: Any
    """Until the end or a terminal status."""
    sound: Any
    """Every number that any call returned was finite, and the phase inside the support phase."""

    @property
    def status(self) -> list[Status]:
        """By name."""
        return [Status(int(word)) for word in self.contact.status]

    def of(self, which) -> March:
        """Some of the walks."""
        return jax.tree.map(lambda leaf: leaf[which], self)


def march(
    starts: Sequence[Start],
    model: BipedModel,
    dtype: Any,
    integrator: Integrator = "rk4_split",
) -> March:
    """Run the walks side by side in `dtype`; NumPy arrays, one entry a walk.

    Walks are stopped by a terminal status. There is one program for each integrator, type and kind
    of model; all models of a call must be of one kind.
    """
    batches = [
        _one_batch(starts[at : at + ROWS], model, dtype, integrator)
        for at in range(0, len(starts), ROWS)
    ]
    return jax.tree.map(lambda *parts: np.concatenate(parts), *batches)


def _one_batch(starts: Sequence[Start], model: BipedModel, dtype: Any, integrator) -> March:
    rows = [*starts, *[Start(count=0)] * (ROWS - len(starts))]

    def column(name: str, kind=dtype):
        return jnp.asarray(np.array([getattr(row, name) for row in rows]).astype(kind))

    kinetic = [row.mu_static if row.mu_kinetic is None else row.mu_kinetic for row in rows]
    scenes = Scene(Uniform(column("mu_static"), jnp.asarray(np.array(kinetic).astype(dtype))))
    low, high = (np.asarray(end, dtype) for end in (SUPPORT_START, SUPPORT_END))
    phase = np.array([row.phase for row in rows]).astype(dtype)
    phase[np.abs(phase - low) < 1e-6] = low  # the ends as this type rounds them
    phase[np.abs(phase - high) < 1e-6] = high
    zero = jnp.zeros(ROWS, dtype)
    states = BipedState(
        phase=jnp.asarray(phase),
        steps=jnp.zeros(ROWS, jnp.int32),
        crank_rate=column("crank_rate"),
        foot_position=zero,
        foot_velocity=column("foot_velocity"),
        time=zero,
    )
    plain = jax.tree.map(np.asarray, model)
    models = [plain if row.model is None else jax.tree.map(np.asarray, row.model) for row in rows]
    stacked = jax.tree.map(lambda *leaves: jnp.asarray(np.stack(leaves)), *models)
    counts = column("count", np.int32)
    many = _march(integrator, stacked, scenes, states, column("torque"), column("dt"), counts)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[: len(starts)], many)


@partial(jax.jit, static_argnums=0)
def _march(integrator, models, scenes, states, torques, sizes, counts) -> March:
    """Every row for as many calls as it wants; the slowest row says how many rounds there are."""

    def go(model, scene, state, torque, size):
        return step(model, scene, state, torque, size, integrator=integrator)

    first = jax.eval_shape(jax.vmap(go), models, scenes, states, torques, sizes)[1]
    blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), first)
    zero, none = jnp.zeros_like(torques), jnp.zeros_like(counts)
    begin = March(states, blank, zero, zero, none, none, none, jnp.ones(counts.shape, bool))

    def body(_, now: March) -> March:
        state, contact = jax.vmap(go)(models, scenes, now.state, torques, sizes)
        after = March(
            state=state,
            contact=contact,
            work=now.work + contact.work,
            path=now.path + contact.slide_distance,
            switches=now.switches + contact.switches,
            most_switches=jnp.maximum(now.most_switches, contact.switches),
            calls=now.calls + 1,
            sound=now.sound & _sound(state, contact),
        )
        runs = (now.contact.status <= Status.SLIP_ONSET) & (now.calls < counts)
        return jax.tree.map(lambda new, old: jnp.where(runs, new, old), after, now)

    return jax.lax.fori_loop(0, jnp.max(counts), body, begin)


def _sound(state: BipedState, contact: Contact):
    """Whether a call's numbers can be used: finite, and the phase where it belongs."""
    leaves = jax.tree.leaves((state, contact))
    finite = jnp.all(jnp.stack([jnp.isfinite(leaf) for leaf in leaves]), axis=0)
    low, high = (jnp.asarray(end, state.phase.dtype) for end in (SUPPORT_START, SUPPORT_END))
    return finite & (state.phase >= low) & (state.phase <= high)
