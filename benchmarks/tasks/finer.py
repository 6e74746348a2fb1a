"""What returns on the biped's tasks owe to the integrator's setting.

    python -m benchmarks.tasks.finer [--only NAME ...]

Replays doing nothing, every baseline, the package's policy and the best known one on the task's own
episodes, at the task's setting and in sixteenths of its step in float64. Episodes begin alike, so
returns are compared pairwise. A score owes what it loses when it is computed finely; LIMIT is the
most that a best known and a policy of the package may owe.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import measured_parts, options
from benchmarks.tasks.measure import rounded
from benchmarks.tasks.recipes import ALIKE, OWING, SWITCHES, recipe_of
from stickslip.agents.evaluation.evaluate import play
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.evaluation.table import mean_interval
from stickslip.agents.idle import Idle
from stickslip.agents.policy.file import load_policy
from stickslip.agents.registry import machine_by_name
from stickslip.agents.shipped.names import policy_name, shipped_path
from stickslip.agents.shipped.record import record_of
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs import TASKS, BipedEnv, known_of, task_by_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stickslip.agents.evaluation.standard import StandardEpisodes
    from stickslip.envs import TaskDefinition
    from stickslip.envs.tasks.known import Known

PART = 16
"""Steps in place of one."""
LIMIT = 0.01
"""The most that a score may owe."""
OUT = Path("benchmarks/results/finer.json")


@dataclass(frozen=True)
class StartedInSingle(BipedEnv):
    """Episodes begin as in single precision, whatever they are computed in: draws differ else."""

    def reset_env(self, key, params):
        """See FunctionalEnv."""
        own = jnp.result_type(params.robot.params.mass)
        obs, state = super().reset_env(key, _in(params, jnp.float32))
        return _in(obs, own), _in(state, own)


def main(arguments: list[str]) -> None:
    """Replay and keep the returns."""
    parser = options("tasks.finer", __doc__, OUT)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    given = parser.parse_args(arguments)
    jax.config.update("jax_enable_x64", True)
    asked = {name: partial(rows_of, task_by_name(name)) for name in given.only or names()}
    measured_parts(asked, names(), False, given.out)


def names() -> list[str]:
    """The biped's tasks; the UGV's integrate no motion."""
    return [name for name, task in TASKS.items() if task.machine == "biped"]


def rows_of(task: TaskDefinition, quick: bool = False) -> Iterator[dict[str, Any]]:
    """A row a player, with what its score owes and the 95 % interval of that."""
    del quick
    known = known_of(task)
    if known is None:
        return
    span = known.scale.one - known.scale.zero
    for name, player in players_of(task, known):
        coarse, fine = (played_in(part, task, player, known.episodes) for part in (1, PART))
        yield row(name, coarse, fine, span)


def row(name: str, coarse: StandardEpisodes, fine: StandardEpisodes, span: float) -> dict[str, Any]:
    """What a player earned, how often it fell, what its score owes. span: of a score in returns."""
    owed = mean_interval((coarse.reward - fine.reward) / span)
    return {
        "policy": name,
        "return": rounded(float(coarse.reward.mean())),
        "finely": rounded(float(fine.reward.mean())),
        "failures": [float(one.fell.mean()) for one in (coarse, fine)],
        "owes": [round(end, 5) if np.isfinite(end) else None for end in owed],
    }


@register_pytree
@dataclass(frozen=True)
class OneOf:
    """One of some controllers, chosen by a number: a program serves all of them."""

    players: tuple[Any, ...]
    index: int

    def validate(self) -> OneOf:
        """See Controller."""
        return self

    def init(self, env_params: Any, env_state: Any) -> tuple[Any, ...]:
        """The memories of all."""
        return tuple(one.init(env_params, env_state) for one in self.players)

    def act(self, memory: Any, obs: Any, env_state: Any, env_params: Any) -> tuple[Any, Any]:
        """See Controller."""
        found = [
            one.act(kept, obs, env_state, env_params)
            for one, kept in zip(self.players, memory, strict=True)
        ]
        kept, actions = zip(*found, strict=True)
        return kept, jnp.stack(actions)[self.index]


def players_of(task: TaskDefinition, known: Known) -> Iterator[tuple[str, Any]]:
    """Doing nothing, the baselines, the package's policy and the best known or planned, by name."""
    machine, (env, params) = machine_by_name(task.machine), task.make()
    found: dict[str, Any] = {"idle": Idle(machine.outputs)}
    found |= {one.policy: machine.baseline(one.policy, env) for one in known.baselines}
    name = policy_name(task.name)
    if shipped_path(name) is not None:
        found[record_of(name).short_name] = load_policy(name)
    for index, one in enumerate(found):
        yield one, OneOf(tuple(found.values()), index)
    if known.best.policy not in found or task.name in OWING:
        recipe = recipe_of(ALIKE.get(task.name, task.name))
        yield recipe.name, recipe.make(env, params)


def played_in(part: int, task: TaskDefinition, player: Any, episodes: int) -> StandardEpisodes:
    """The task's own episodes in so many steps for each of its own; more than one in float64. A
    player that plans with the environment's step goes on planning with the task's."""
    env = without_resets(StartedInSingle(**BipedEnv.choices_from_plain(task.choices)))
    dtype = jnp.float32 if part == 1 else jnp.float64
    if part > 1:
        count = part * env.substeps
        env = replace(env, substeps=count, max_events=SWITCHES * count)
    params = env.make_params(**BipedEnv.from_plain(task.parameters), dtype=dtype)
    return play(env, _in(player, dtype), params, range(episodes), keep_of)


def _in(tree: Any, dtype: Any) -> Any:
    """The tree with its real numbers in another precision."""

    def one(leaf: Any) -> Any:
        real = jnp.issubdtype(jnp.result_type(leaf), np.floating)
        return jnp.asarray(leaf, dtype) if real else leaf

    return jax.tree.map(one, tree)


if __name__ == "__main__":
    main(sys.argv[1:])
