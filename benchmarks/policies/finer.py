"""What the biped's policies of the package earn where their task is computed more finely.

    python -m benchmarks.policies.finer [--only NAME ...] [--episodes N] [--docs FILE]

A task computes a control period in one integrator step. Plays every policy in half and a quarter
of it, and at the preset "exact" (EventExact at 1e-10, finest table, float64): what it loses there
it owes to the step's errors. Episodes begin alike everywhere, drawn in single precision from seeds
0, 1, ... Results are kept in --out, those not named in --only as they were; ten minutes of
processor time for all, half a minute for the sprint. With --docs alone nothing is played.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import kept_parts, markdown, options, provenance, put_between, write_json
from benchmarks.tasks.measure import entry
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import is_random, play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.policy.file import load_policy
from stickslip.agents.shipped.names import policy_name, shipped_path
from stickslip.agents.shipped.record import record_of
from stickslip.envs import TASKS, BipedEnv, known_of, task_by_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stickslip.envs import TaskDefinition

EPISODES = 256
SUBSTEPS = {"task's step": 1, "half": 2, "quarter": 4}
EXACT = "exact"
SWITCHES = 3
"""Located in each substep."""
MARKS = ("<!-- finer -->", "<!-- end of finer -->")


@dataclass(frozen=True)
class StartedInSingle(BipedEnv):
    """Episodes begin as in single precision, whatever they are computed in: draws differ else."""

    def reset_env(self, key, params):
        """See FunctionalEnv."""
        own = jnp.result_type(params.robot.params.mass)
        obs, state = super().reset_env(key, _in(params, jnp.float32))
        return _in(obs, own), _in(state, own)


def main(arguments: list[str]) -> None:
    """Play, keep and write into a page."""
    parser = options("policies.finer", __doc__, Path("benchmarks/results/finer.json"))
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument("--docs", type=Path)
    given = parser.parse_args(arguments)
    jax.config.update("jax_enable_x64", True)
    names = [name for name in TASKS if (name in (given.only or TASKS)) and is_shipped(name)]
    content = kept_parts(given.out, TASKS)
    for name in names if given.only or given.docs is None else []:
        content[name] = list(rows_of(task_by_name(name), given.episodes))
        stamp = provenance()
        content["parts"][name] = {at: stamp[at] for at in ("commit", "measured")}
        write_json(content, given.out)
    if given.docs is not None:
        put_between(given.docs, table(content), MARKS)


def is_shipped(name: str) -> bool:
    """Whether there is a policy of the package for a task of the biped."""
    return task_by_name(name).machine == "biped" and shipped_path(policy_name(name)) is not None


def rows_of(task: TaskDefinition, episodes: int) -> Iterable[dict[str, Any]]:
    """What the task's policy earns at each step, and said as it comes."""
    policy, known = load_policy(policy_name(task.name)), known_of(task)
    choices = BipedEnv.choices_from_plain(task.choices)
    for step in (*SUBSTEPS, EXACT):
        env = without_resets(StartedInSingle(**choices))
        if step == EXACT:
            env = replace(env, setting="exact")
        elif SUBSTEPS[step] > 1:
            count = SUBSTEPS[step]
            env = replace(env, substeps=count, max_events=SWITCHES * count)
        single: dict[str, Any] = {} if step == EXACT else {"dtype": "float32"}
        params = env.make_params(**BipedEnv.from_plain(task.parameters), **single)
        count = episodes if is_random(params) else 1
        played = play(env, policy, params, range(count), keep_of)
        row = {"step": step, "episodes": count, **entry(step, played.reward, played.fell)}
        row["score"] = None if known is None else round(known.scale.score(row["return"]), 4)
        del row["policy"], row["returns"]
        print(f"{task.name}: {row}", flush=True)
        yield row


def table(content: dict[str, Any]) -> str:
    """Scores, a row a policy and a column a step, and the share of falls where there are any."""
    rows = []
    for name in filter(is_shipped, TASKS):
        found = {one["step"]: one for one in content.get(name, [])}
        cells = {step: _cell(found.get(step)) for step in (*SUBSTEPS, EXACT)}
        rows.append({"policy": f"`{record_of(policy_name(name)).short_name}`", **cells})
    return markdown(rows)


def _cell(row: dict[str, Any] | None) -> str:
    if row is None or row["score"] is None:
        return ""
    falls = f", {row['failures']:.1%} fall" if row["failures"] else ""
    return f"{row['score']:.3f}{falls}"


def _in(tree: Any, dtype: Any) -> Any:
    """The tree with its real numbers in another precision."""

    def one(leaf: Any) -> Any:
        real = jnp.issubdtype(jnp.result_type(leaf), np.floating)
        return jnp.asarray(leaf, dtype) if real else leaf

    return jax.tree.map(one, tree)


if __name__ == "__main__":
    main(sys.argv[1:])
