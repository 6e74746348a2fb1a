"""Episodes of named tasks as Minari data sets, for offline reinforcement learning."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation import players, rollout
from stickslip.agents.machine import machine_by_name
from stickslip.dynamics import checks
from stickslip.dynamics.lazily import require
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.functional import horizon
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import measured
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_makeable
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from jaxtyping import Array, Float, PRNGKeyArray

    from stickslip.agents.protocol import AnyEnv, Controller, Options, Player, Timed
    from stickslip.envs.tasks.definition import TaskDefinition

EPISODES, FIRST_SEED = 30, 2**20
"""Episodes of each policy with each noise, and the seed of the first: those of test episodes are
smaller, those of validation episodes greater."""
ROOT, NAME = "MINARI_DATASETS_PATH", re.compile(r"(?:[\w-][\w/-]*[\w-]/)?[\w-]+-v\d+")
NAMES = "name-v0 or namespace/name-v0, of letters, digits, - and _, two and more in a namespace"
INFOS = "a function of an episode and its seed that returns arrays [length + 1] by new names"
Infos: TypeAlias = Callable[[rollout.Rollout[Any], int], Mapping[str, np.ndarray]]
"""Further infos [length + 1] of a trimmed episode and its seed; the first row is the reset's."""


@register_pytree
@dataclass(frozen=True)
class Noisy:
    """(1 - noise) times a controller's action and noise times one drawn evenly from the box."""

    controller: Controller
    noise: Float[Array, ""]
    key: PRNGKeyArray

    def init(self, env_params: Timed, env_state: Any) -> tuple[Any, PRNGKeyArray]:
        """See Controller."""
        return self.controller.init(env_params, env_state), self.key

    def act(
        self, memory: tuple[Any, PRNGKeyArray], obs: Array, env_state: Any, env_params: Timed
    ) -> tuple[tuple[Any, PRNGKeyArray], Float[Array, " act"]]:
        """See Controller."""
        own, (key, now) = memory[0], jax.random.split(memory[1])
        own, action = self.controller.act(own, obs, env_state, env_params)
        drawn = jax.random.uniform(now, action.shape, action.dtype, minval=-1.0, maxval=1.0)
        share = self.noise.astype(action.dtype)
        return (own, key), (1 - share) * jnp.clip(action, -1, 1) + share * drawn

    def validate(self) -> Noisy:
        """Return self."""
        return self


def record(
    task: str,
    controllers: Mapping[str, Player],
    dataset: str,
    *,
    noise: Sequence[float] = (0.0,),
    episodes: int = EPISODES,
    seed: int = FIRST_SEED,
    infos: Infos | None = None,
    regret: bool = False,
) -> Table:
    """Record a named task as a Minari data set, which `minari.load_dataset(dataset)` reads.

    Each controller plays so many episodes with each share of noise (see Noisy); a share of 1 is a
    random policy. The first episode is that of `reset(seed=seed)`, the next that of seed + 1.
    Minari's normalised score is the task's score. Infos hold `cost` [length + 1], what a limit
    counts, and what `infos` returns; the metadata of an episode its policy, noise and seed. regret:
    infos hold `value` and `regret`, too, those of RegretInfo, on tasks of the UGV.
    Returns episodes, steps, mean return and mean cost of each controller with each noise.
    ValueError for an unknown task, a data set that exists or a name that Minari does not take.
    """
    defined = task_by_name(task)
    rollout.require_named("controllers", controllers, "{name: controller}")
    checks.require_number("noise", noise, low=0.0, high=1.0, accepted="shares from 0 to 1")
    if np.ndim(noise) > 1:
        raise ValueError(f"noise has shape {np.shape(noise)}; accepted: a row of shares")
    shares = np.atleast_1d(np.asarray(noise, float)).tolist()
    pairs: list[tuple[str, float]] = list(product(controllers, shares))
    most = rollout.MOST_EPISODES // len(pairs)
    accepted = f"an integer from 1 to {most}, for each of {len(pairs)} policies and noises"
    checks.require_integer("episodes", episodes, high=most, accepted=accepted)
    checks.require_integer(
        "seed", seed, low=0, high=rollout.VALIDATION_SEEDS - len(pairs) * episodes
    )
    if infos is not None:
        checks.require_kind("infos", infos, Callable, INFOS)  # pyright: ignore[reportArgumentType]
    checks.require_kind("regret", regret, bool, "True or False")
    path = new_dataset(dataset)
    env, params = defined.make()
    further = [] if infos is None else [infos]
    if regret:
        further.append(machine_by_name(defined.machine).regrets(env, params))
    what = f"{len(pairs)} times {episodes} episodes"
    size = len(pairs) * episodes, horizon(params) * rollout.STEP_BYTES
    checks.require_memory(what, f"episodes of {horizon(params)} steps", *size)
    rows, buffers = [], []
    for name, share in pairs:
        say_stage(f"recording {name}, noise {share:g}")
        seeds = range(seed + len(buffers), seed + len(buffers) + episodes)
        who = rollout.validated(f"controllers[{name!r}]", controllers[name])
        rollouts = _rollouts(rollout.without_resets(env), who, params, seeds, share)
        buffers += [_buffer(one, its, further) for one, its in zip(rollouts, seeds, strict=True)]
        rows.append((name, share, episodes, *_sums(buffers[-episodes:])))
    _make_namespace(dataset)
    with TemporaryDirectory(dir=path.parent, prefix=".") as folder:
        _store(Path(folder) / path.name, dataset, defined, buffers, pairs)
        os.rename(Path(folder) / path.name, path)
    units = {"noise": "-", "episodes": "-", "steps": "-", "return": defined.unit, "cost": "-"}
    return Table((Column("policy", words=True), *map(Column, units, units.values())), rows)


def _rollouts(
    env: AnyEnv, controller: Player, params: Timed, seeds: Sequence[int], noise: float
) -> Iterator[rollout.Rollout]:
    """The seeds' episodes, trimmed."""
    given = *rollout.paths(env, controller, params, seeds), params
    keys = rollout.episode_keys(np.asarray(seeds, np.uint32))
    rollouts = _side_by_side(env, horizon(params), *given, keys, np.float32(noise))
    rollouts = jax.tree.map(np.asarray, rollouts)
    for i in range(len(seeds)):
        yield jax.tree.map(lambda leaf, i=i: leaf[i], rollouts).trimmed()


@partial(jax.jit, static_argnums=(0, 1, 2))
def _side_by_side(
    env: AnyEnv,
    steps: int,
    axis: int | None,
    controller: Controller,
    params: Timed,
    keys: PRNGKeyArray,
    noise: Float[Array, ""],
) -> rollout.Rollout:
    def one(controller: Controller, key: PRNGKeyArray) -> rollout.Rollout:
        noisy = Noisy(controller, noise, jax.random.fold_in(key, 1))
        return rollout.rollout(env, noisy, params, key, steps)

    return jax.vmap(one, (axis, 0))(controller, keys)


def _buffer(episode: rollout.Rollout, seed: int, infos: Sequence[Infos]) -> Any:
    """An episode in Minari's words."""
    from minari.data_collector import EpisodeBuffer

    more = {}
    for entries in infos:
        more |= _checked(entries(episode, seed), 1 + int(episode.length), {"cost", *more})
    made: dict[str, Any] = {
        "observations": np.concatenate([episode.start_obs[None], episode.obs]),
        "actions": episode.action,
        "rewards": episode.reward,
        "terminations": episode.terminated,
        "truncations": episode.truncated,
        "infos": {"cost": np.append(np.float32(0), episode.info["cost"]), **more},
    }
    return EpisodeBuffer(seed=seed, **made)


def _sums(buffers: Sequence[Any]) -> tuple[int, float, float]:
    """Steps, mean return and mean cost."""
    steps = sum(len(one.rewards) for one in buffers)
    earned, cost = (
        float(np.mean([np.sum(row, dtype=float) for row in rows]))
        for rows in zip(*((one.rewards, one.infos["cost"]) for one in buffers), strict=True)
    )
    return steps, earned, cost


def _checked(found: Any, rows: int, taken: Set[str]) -> Mapping[str, np.ndarray]:
    """Infos of an episode, or ValueError, also for a name that is taken."""
    checks.require_kind("infos(...)", found, Mapping, INFOS)
    checked = {str(name): np.asarray(one) for name, one in found.items()}
    for name, one in checked.items():
        if name in taken or one.shape[:1] != (rows,) or one.dtype.kind not in "biuf":
            raise ValueError(f"infos: {name!r} of shape {one.shape}; accepted: {INFOS}")
    return checked


def new_dataset(dataset: str) -> Path:
    """The folder of a data set that is not there yet. ValueError for one that exists, is inside
    another one, or has a name that Minari does not take; OSError where it cannot be written."""
    require("minari", "a recording", extra="data")
    from minari.storage import get_dataset_path

    checks.require_kind("dataset", dataset, str, NAMES)
    checks.require_that(NAME.fullmatch(dataset), "dataset", dataset, NAMES)
    if not os.path.isabs(os.environ.get(ROOT, os.sep)):
        raise ValueError(f"{ROOT} = {checks.shown(os.environ[ROOT])}; accepted: an absolute path")
    root = Path(get_dataset_path())
    path = root / dataset
    within = [one for one in path.parents if (one / "data" / "metadata.json").exists()]
    if os.path.lexists(path) or within:
        raise ValueError(f"{[path, *within][-1]} exists; accepted: the name of a new data set")
    require_makeable(path.parent, path)
    return path


def _make_namespace(dataset: str) -> None:
    """Make the folders above a data set as Minari does."""
    from minari.namespace import create_namespace, list_local_namespaces

    namespace, _, _ = dataset.rpartition("/")
    if namespace and namespace not in list_local_namespaces():
        create_namespace(namespace)


def _store(
    path: Path, dataset: str, task: TaskDefinition, buffers: list[Any], pairs: list[Any]
) -> None:
    """Write a data set to a folder; pairs: policy and noise of equally many episodes each."""
    import gymnasium
    import minari
    from minari.dataset.minari_storage import MinariStorage

    known = measured(task.name)
    about = {
        "dataset_id": dataset,
        "minari_version": minari.__version__,
        "algorithm_name": ", ".join(f"{name} with noise {noise:g}" for name, noise in pairs),
        "description": task.headline,
        "requirements": [f"stickslip=={version('stickslip')}"],
        "ref_min_score": known.trivial.value,
        "ref_max_score": known.best.value,
        "num_episodes_average_score": known.episodes,
    }
    path.mkdir()
    storage = MinariStorage.new(path / "data", env_spec=gymnasium.spec(task.id))
    storage.update_metadata(about)
    storage.update_episodes(buffers)
    each = len(buffers) // len(pairs)
    storage.update_episode_metadata(
        {"policy": name, "noise": noise} for name, noise in pairs for _ in range(each)
    )


def record_command(given: Options) -> Content:
    """`stickslip record`: record policies on a task, print the table and what reads it."""
    named = players.read_named(
        given["who"], given["task"] and machine_by_name(task_by_name(given["task"]).machine)
    )
    task = given["task"] or players.shared_task(named)
    if task is None:
        raise ValueError("no common task; accepted: --task, or policies trained on one named task")
    usual = f"stickslip/{task_by_name(task).name}/episodes-v0"
    dataset = usual if given["dataset"] is None else given["dataset"]
    new_dataset(dataset)  # a baseline may plan for long
    how = {name: given[name] for name in ("episodes", "noise", "seed", "regret")}
    table = record(task, players.players_on(task, named), dataset, **how)
    print(f"{table.rounded(4).terminal()}\nminari.load_dataset({dataset!r})")
    return Content({"recorded": table}, {"task": task, "dataset": dataset})
