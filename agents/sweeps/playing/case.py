"""Who plays what in a sweep: a policy on a task, whose numbers the axes then set."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.evaluation.rollout import horizon, without_resets
from stickslip.agents.evaluation.run import is_random
from stickslip.agents.optimum.checkpoint import digest_of
from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.agents.protocol import Controller, Planner

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jaxtyping import PyTree

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed
    from stickslip.agents.sweeps.design import Design

MOST_CORNERS = 4
"""Axes of which every corner of their box is looked at beforehand; of more, the ends of each."""


class Played(NamedTuple):
    """A policy on a task, as it was given."""

    task: str
    policy: str
    env: AnyEnv
    params: Timed
    player: AnyPlayer


@dataclass(frozen=True)
class Case:
    """The same, made ready: the structure has a place for every axis.

    fields: axis -> dotted fields that it sets. steps: control steps of the longest episode. draws:
    whether a reset draws anything that no axis sets.
    """

    task: str
    policy: str
    env: AnyEnv
    params: PyTree
    player: PyTree
    fields: dict[str, tuple[str, ...]]
    steps: int
    draws: bool = True

    @property
    def place(self) -> str:
        """What decides the program beside the player: environment and parameters, as a digest."""
        return digest_of(self.env, self.params, sorted(self.fields.items()), self.steps)


def case_of(machine: AnyMachine, given: Played, design: Design) -> Case:
    """A case, looked at before anything is compiled.

    ValueError naming the axis or the policy for unknown fields, values that the task would not
    take, a policy of something else and planners.
    """
    swept = machine.swept()
    env = without_resets(given.env)
    player = _require_player(given, env)
    params = swept.opened(given.params, design.axes)
    fields = {name: swept.targets(params, name) for name in design.axes}
    _require_apart(fields)
    corners = [params]
    for values in _corners(design):
        numbers = {one: values[name] for name in values for one in fields[name]}
        try:
            corners.append(swept.put(params, numbers))
            swept.require_within(corners[-1])
        except ValueError as error:
            told = ", ".join(f"{name} = {value:g}" for name, value in values.items())
            raise ValueError(f"at {told}: {error}") from error
    steps = max(horizon(one) for one in corners)
    draws = is_random(corners[-1])
    return Case(given.task, given.policy, env, params, player, fields, steps, draws)


def _require_player(given: Played, env: AnyEnv) -> Controller[PyTree, PyTree, PyTree]:
    player, name = given.player, given.policy
    if isinstance(player, Planner) and not isinstance(player, Controller):
        raise ValueError(
            f"{name} plans each episode before it begins; accepted: policies and controllers, "
            "whose episodes a program plays side by side"
        )
    if isinstance(player, MLPPolicy):
        seen, made = len(env.observation_bounds(given.params)[0]), player.layer_sizes
        if made[0] != seen or made[-1] != len(env.action_names):
            raise ValueError(
                f"{name} observes {made[0]} numbers and gives {made[-1]}, {given.task} has {seen} "
                f"and takes {len(env.action_names)}; accepted: a policy trained on what the task "
                "observes"
            )
    return player.validate()


def _require_apart(fields: Mapping[str, Sequence[str]]) -> None:
    """ValueError where two axes set one field."""
    owner: dict[str, str] = {}
    for name, targets in fields.items():
        for one in targets:
            if one in owner:
                raise ValueError(
                    f"axes {owner[one]} and {name} both set {one}; accepted: one of them"
                )
            owner[one] = name


def _corners(design: Design) -> list[dict[str, float]]:
    """Values at the corners of the axes' box, or at either end of each axis where it has many."""
    ends = {name: dict.fromkeys(axis.ends) for name, axis in design.axes.items()}
    if len(ends) <= MOST_CORNERS:
        found = itertools.product(*ends.values())
        return [dict(zip(ends, one, strict=True)) for one in found] if ends else []
    first = {name: next(iter(values)) for name, values in ends.items()}
    return [first] + [first | {name: one} for name in ends for one in list(ends[name])[1:]]


def marks_of(values: Mapping[str, np.ndarray], count: int) -> np.ndarray:
    """A number for each point that its axes' names and values decide, [count], unsigned."""
    import hashlib

    columns = [values[name] for name in sorted(values)]
    head = ",".join(sorted(values)).encode()
    rows = np.stack(columns, 1) if columns else np.zeros((count, 0))
    found = (hashlib.blake2b(head + row.tobytes(), digest_size=4).digest() for row in rows)
    return np.asarray([int.from_bytes(one, "little") for one in found], np.uint32)
