"""Description of a policy's task in its file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.registry import machine_of_env

if TYPE_CHECKING:
    from stickslip.agents.foreign.reading import Json
    from stickslip.agents.protocol import Params, State
    from stickslip.envs.functional import FunctionalEnv


def describe_environment(env: FunctionalEnv[State, Params], params: Params) -> dict[str, Json]:
    """An environment and its parameters as JSON values, for the metadata of `save_policy`.

    For people, and for `evaluate` and `view`, which show the policy on its own task. ValueError for
    an environment of no machine, and for parameters of another one.
    """
    machine = machine_of_env(env)
    env.check_params(params)
    return machine.describe(env, params)
