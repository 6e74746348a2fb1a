"""Policies of either kind from their files: networks, and values that are looked ahead to."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from stickslip.agents.optimum.file import read_value_metadata, read_value_policy
from stickslip.agents.optimum.policy import ValuePolicy
from stickslip.agents.policy.file import policy_path, read_metadata, read_policy
from stickslip.agents.untrusted import RefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed
    from stickslip.agents.untrusted import Json


def read_player(path: Path) -> tuple[AnyPlayer, dict[str, Json]]:
    """The policy in a file, and what the file says of itself.

    ValueError naming the file for one that is damaged or of neither kind.
    """
    if read_value_metadata(path) is None:
        return read_policy(path)
    policy, _, metadata = read_value_policy(path)
    return policy, metadata


def read_about(path: Path) -> dict[str, Json]:
    """Metadata of a file of either kind. ValueError as in `read_player`."""
    found = read_value_metadata(path)
    return read_metadata(path) if found is None else found


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Inside, what is refused of a file's contents is a ValueError that names the file."""
    try:
        yield
    except RefusedError as error:
        raise ValueError(f"{path}: {error}") from error


def fitted(
    policy: AnyPlayer, name: str, env: AnyEnv, params: Timed, machine: AnyMachine
) -> AnyPlayer:
    """The policy for an environment: one that looks ahead does so with the environment's own step.

    ValueError for one whose values do not say what later rewards depend on there.
    """
    if not isinstance(policy, ValuePolicy):
        return policy
    try:
        states = machine.state_map(env, params)
    except ValueError as error:
        raise ValueError(f"{policy_path(name)}, a value policy: {error}") from error
    if states != policy.states:
        raise ValueError(
            f"{policy_path(name)} holds values of {policy.states}, this task has {states}; "
            "accepted: a value policy for a task of the same coordinates"
        )
    return replace(policy, env=env)
