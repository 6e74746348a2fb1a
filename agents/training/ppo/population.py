"""A population: several trainings in one program, apart in their seeds or their numbers."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Generic, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.jax_trainer import same_step, shapes_of
from stickslip.agents.training.learner import Rates, Sizes, Start, begin_episodes, network
from stickslip.agents.training.ppo.algorithm import Learner, begin_learning, improve, rollout
from stickslip.dynamics.checks import require_integer, require_kind, require_memory
from stickslip.envs.collecting import cores_here

if TYPE_CHECKING:
    from collections.abc import Callable

    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.envs.functional import FunctionalEnv

RETURN = "episode_return"
"""The entry of info whose mean over the episodes that end is kept."""
MOST = 4096
"""Members of a population."""
LEARNT = 4 * 4
"""Bytes of a weight, its slope and what the optimiser remembers of it."""
LOSSES = 8
"""About how many numbers of each update are kept."""


class Population(NamedTuple):
    """Where the members of a population are; every leaf [members, ...]."""

    learner: Learner
    timesteps: int
    """That each has made."""
    losses: dict[str, Float[np.ndarray, "members updates"]]
    """Of every update so far, and under "return" the mean of the episodes that ended in it (NaN
    without any)."""

    def policy(self, member: int) -> MLPPolicy:
        """What a member has learnt, without exploration."""
        actor, seen = jax.tree.map(
            lambda leaf: leaf[member], (self.learner.actor, self.learner.seen)
        )
        return network(actor, seen).validate()


def train_population(
    env: FunctionalEnv[State, Params],
    params: Params,
    settings: tuple[Sizes, Rates],
    seeds: Sequence[int],
    *,
    timesteps: int,
    stretches: int = 1,
    tell: Callable[[Population], object] = lambda population: None,
    cores: int | None = None,
    vmapped: bool | None = None,
) -> Population:
    """Train one member a seed on an environment, each as `PPOTrainer` does.

    params: of training episodes, shared by all. settings: sizes, and rates whose entries are
    numbers or arrays [members]: so a population goes over hyperparameters, too. timesteps: of each
    member; learning ends with the first update that reaches it. Members differ from single
    trainings in roundings at most, which training makes large in time.

    The members of a thread are one program. vmapped: they make their updates together, else one
    after the other; default: but on a processor, which gains nothing by batches of small matrix
    products.

    stretches: parts of about equal length, after each of which tell(population) is called; the
    episodes go on from one to the next. cores: threads that share the members; default: as many as
    there are. ValueError for numbers that are none and for what memory cannot hold.
    """
    accepted = "a pair of Sizes and Rates"
    require_kind("settings", settings, (tuple, list), accepted)
    if len(settings) != 2:
        raise ValueError(f"settings has {len(settings)} entries; accepted: {accepted}")
    sizes, rates = settings
    require_kind("settings", sizes, Sizes, accepted)
    require_kind("settings", rates, Rates, accepted)
    env.check_params(params)
    require_kind("seeds", seeds, (Sequence, np.ndarray), "one whole number a member, in a list")
    members = require_integer("len(seeds)", len(seeds), high=MOST)
    numbers = [require_integer("seed", seed, low=0, high=2**31 - 1) for seed in seeds]
    timesteps = require_integer("timesteps", timesteps, high=10**12)
    updates = -(-timesteps // sizes.samples)
    parts = min(require_integer("stretches", stretches, high=10**6), updates)
    inputs, names = shapes_of(env, params)
    kept = 4 * (3 * inputs + 2 * len(env.action_names) + 8)
    given = (
        f"{members} seeds with num_envs = {sizes.num_envs}, rollout_steps = {sizes.rollout_steps}"
    )
    require_memory(given, "samples", members * sizes.samples, kept)
    _require_room(sizes, inputs, members, updates)
    infos = (RETURN,) if RETURN in names else ()
    if vmapped is None:
        vmapped = jax.default_backend() != "cpu"
    program = _Program(same_step(env), sizes, inputs, infos, bool(vmapped))
    rates = _spread(rates.validate(), members)
    groups = _groups(members, cores)
    at = [_begin(program, params, np.asarray(numbers)[group]) for group in groups]
    own = [jax.tree.map(lambda leaf, group=group: leaf[group], rates) for group in groups]
    ends = [-(-updates * part // parts) for part in range(parts + 1)]
    now = Population(_joined(at), 0, {})
    with ThreadPoolExecutor(len(groups)) as pool:
        for first, last in itertools.pairwise(ends):
            shares = [index * sizes.samples / timesteps for index in range(first, last)]
            run = partial(_advance, program, params, first, shares)
            at, rows = zip(*pool.map(run, own, at), strict=True)
            losses = {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
            losses = {
                name: np.hstack([now.losses.get(name, row[:, :0]), row])
                for name, row in losses.items()
            }
            now = Population(_joined(at), last * sizes.samples, losses)
            tell(now)
    return now


def _require_room(sizes: Sizes, inputs: int, members: int, updates: int) -> None:
    """Raise ValueError for networks or tables of losses that no memory holds."""
    widths = [inputs, *[sizes.hidden] * sizes.layers, 1]
    weights = sum((one + 1) * other for one, other in itertools.pairwise(widths))
    given = f"{members} seeds with hidden = {sizes.hidden}, layers = {sizes.layers}"
    require_memory(given, "networks of an actor and a critic", 2 * members, LEARNT * weights)
    given = f"timesteps with num_envs x rollout_steps = {sizes.samples}"
    require_memory(given, "updates", updates, 8 * (members * LOSSES + 1))


class _Program(NamedTuple, Generic[State, Params]):
    """What is static."""

    env: FunctionalEnv[State, Params]
    sizes: Sizes
    inputs: int
    infos: tuple[str, ...]
    vmapped: bool


class _Member(NamedTuple):
    learner: Learner
    start: Start


@partial(jax.jit, static_argnums=0)
def _begin(program: _Program[State, Params], params: Params, seeds: Array) -> _Member:
    def learner(seed: Array) -> Learner:
        outputs = len(program.env.action_names)
        return begin_learning(program.inputs, outputs, program.sizes, jax.random.key(seed))

    def start(seed: Array) -> Start:
        return begin_episodes(program.env, params, program.sizes, seed)

    # One learner after the other: of several at once, LAPACK factorises the weights of different
    # layers in tasks of one thread pool that wait for each other, on two cores for ever.
    return _Member(jax.lax.map(learner, jnp.asarray(seeds)), jax.vmap(start)(seeds))


def _advance(
    program: _Program[State, Params],
    params: Params,
    first: int,
    shares: list[float],
    rates: Rates,
    members: _Member,
) -> tuple[_Member, dict[str, np.ndarray]]:
    """A thread's members after some updates, and the losses of these [members, updates].

    first: the first one's index. shares: of the training that was done before each.
    """
    rows = []
    for index, share in enumerate(shares, first):
        at = jnp.int32(index), jnp.float32(share)
        members, losses = _update(program, params, rates, members, *at)
        rows.append(jax.tree.map(np.asarray, losses))
    return members, {name: np.stack([row[name] for row in rows], 1) for name in rows[0]}


@partial(jax.jit, static_argnums=0)
def _update(
    program: _Program[State, Params],
    params: Params,
    rates: Rates,
    members: _Member,
    index: Array,
    share: Array,
) -> tuple[_Member, dict[str, Array]]:
    """One update of each member."""

    def one(rates: Rates, member: _Member) -> tuple[_Member, dict[str, Array]]:
        now = rates.at(share)
        learner, (progress, key) = member
        given = program.env, params, program.sizes, now.noise, learner
        found = rollout(*given, progress, program.infos)
        own = jax.random.fold_in(key, index)
        learner, losses = improve(learner, found, program.sizes, rates, now, own)
        if program.infos:
            over = found.terminated | found.truncated
            total = jnp.sum(jnp.where(over, found.kept[RETURN], 0.0))
            losses["return"] = total / jnp.sum(over)
        return _Member(learner, Start(found.progress, key)), losses

    if program.vmapped:
        return jax.vmap(one)(rates, members)
    return jax.lax.map(lambda each: one(*each), (rates, members))


def _groups(members: int, cores: int | None) -> list[slice]:
    """Which members a thread has."""
    if cores is None:
        cores = cores_here() if jax.default_backend() == "cpu" else 1
    count = min(require_integer("cores", cores, high=4096), members)
    ends = np.linspace(0, members, count + 1).round().astype(int)
    return [slice(int(first), int(last)) for first, last in itertools.pairwise(ends)]


def _spread(rates: Rates, members: int) -> Rates:
    """Every entry as an array [members]. ValueError for one of another length."""

    def one(value: ArrayLike) -> Array:
        if np.shape(value) not in ((), (members,)):
            raise ValueError(
                f"rates of shape {np.shape(value)} with {members} seeds; accepted: numbers, or "
                f"arrays of shape ({members},)"
            )
        return jnp.broadcast_to(jnp.asarray(value, jnp.float32), (members,))

    return jax.tree.map(one, rates)


def _joined(at: Sequence[_Member]) -> Learner:
    """The learners of all groups, every leaf [members, ...]."""
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *[one.learner for one in at])
