"""Many steps of many environments under a policy: the fastest way to step them."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.kernels.scan import fused_scan
from stickslip.envs.functional import FunctionalEnv, Params, State, abstract_step, pure_step

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

MOST = 2**31 - 1
LEAST_A_CORE = 512
"""Environments for which a second core is worth its start."""
SMALL = 512
"""So few environments take many steps in one kernel; with more of them, a step in each is as fast
or faster, since what they carry no longer fits the nearest cache."""

Policy = Callable[[Any, Any, Any], Any]
"""action [act] in [-1, 1] of (policy_params, observation [obs], random key), for one environment;
a JAX function, and hashable."""


class Progress(NamedTuple, Generic[State]):
    """States of n environments, from which `collect` continues."""

    state: State
    """Every leaf [n]."""
    obs: Float[Array, "n obs"]
    keys: Int[Array, "n words"]
    """A chain of random numbers for each environment, as plain numbers."""


class Collected(NamedTuple, Generic[State]):
    """`steps` control steps of n environments."""

    reward: Float[Array, "steps n"]
    terminated: Bool[Array, "steps n"]
    truncated: Bool[Array, "steps n"]
    kept: dict[str, Array]
    """Entries that `keep` names, each [steps, n, ...]."""
    progress: Progress[State]


def collect(
    env: FunctionalEnv[State, Params],
    params: Params,
    policy: Policy,
    seed: Array | int = 0,
    *,
    num_envs: int,
    steps: int,
    policy_params: Any = None,
    keep: tuple[str, ...] = (),
    progress: Progress[State] | None = None,
    cores: int | None = None,
) -> Collected[State]:
    """Step `num_envs` environments `steps` times under a policy, in one compiled program.

    policy(policy_params, obs, key) gives one environment's action from its observation [obs]; what
    it learns belongs into policy_params, whose numbers compile nothing again. params: shared by
    all. keep: "obs" (what the policy saw), "action", "next_obs" (of the step, before an autoreset)
    and names of info, for each of which an array [steps, n, ...] is returned.

    seed: a number or a JAX random key. Environment i draws its resets and its policy's keys from a
    chain of its own, fold_in(key, i): what becomes of it depends neither on num_envs nor on cores.
    progress: of an earlier call with the same num_envs, to go on; seed is then not read.

    cores: on a processor the environments are divided among so many threads; default: as many as
    there are, while each has 512. Inside a trace, one. With autoreset "disabled" an environment
    whose episode is over is stepped on; use "same_step" or "next_step".

    ValueError for numbers that are none, unknown names in `keep`, and results beyond memory.
    """
    checks.require_kind("env", env, FunctionalEnv, "a BipedEnv or UGVEnv")
    env.check_params(params)
    accepted = "a hashable function of (policy_params, obs, key)"
    checks.require_kind("policy", policy, Hashable, accepted)
    checks.require_kind("policy", policy, Callable, accepted)  # pyright: ignore[reportArgumentType]
    num_envs = checks.require_integer("num_envs", num_envs, high=MOST)
    steps = checks.require_integer("steps", steps, high=MOST)
    key = seed
    if isinstance(seed, int | np.integer):
        key = jax.random.key(checks.require_integer("seed", seed, low=0, high=2**32 - 1))
    checks.require_kind(
        "seed", key, jax.Array, "an integer from 0 to 2**32 - 1, or a key of jax.random"
    )
    if progress is not None:
        checks.require_kind("progress", progress, Progress, "that of an earlier call's result")
        if len(progress.obs) != num_envs:
            raise ValueError(f"progress of {len(progress.obs)} environments; accepted: {num_envs}")
    program = _Program(env, policy, tuple(keep), steps)
    params, policy_params = jax.tree.map(jnp.asarray, (params, policy_params))
    _require_room(program, params, policy_params, num_envs)
    traced = not checks.is_concrete((params, policy_params, key, progress))
    count = 1 if traced else _threads(num_envs, cores)
    now = begin(env, num_envs, params, key) if progress is None else progress
    if count == 1:
        return _collect(program, params, policy_params, now)
    size = -(-num_envs // count)
    places = [slice(at, at + size) for at in range(0, num_envs, size)]
    parts = [jax.tree.map(lambda leaf, at=at: leaf[at], now) for at in places]
    with ThreadPoolExecutor(count) as pool:
        run = partial(_collect, program, params, policy_params)
        found = list(pool.map(lambda part: jax.block_until_ready(run(part)), parts))
    after = jax.tree.map(lambda *each: jnp.concatenate(each), *[part.progress for part in found])
    rows = jax.tree.map(lambda *each: jnp.concatenate(each, 1), *[part[:4] for part in found])
    return Collected._make((*rows, after))


class _Program(NamedTuple):
    """Static part: the key of the compiled program."""

    env: FunctionalEnv
    policy: Policy
    keep: tuple[str, ...]
    steps: int


@partial(jax.jit, static_argnums=(0, 1))
def begin(env: FunctionalEnv, num_envs: int, params: Any, key: Array) -> Progress:
    """Start of `collect`: every environment after its first reset. Nothing is checked."""

    def one(index: Array) -> Progress:
        chain, reset = jax.random.split(jax.random.fold_in(key, index))
        obs, state = env.reset_env(reset, params)
        return Progress(state, obs, jax.random.key_data(chain))

    return jax.vmap(one)(jnp.arange(num_envs))


def _one_step(program: _Program, shared: tuple[Any, Any], progress: Progress, _: None = None):
    """One environment's step, and its rows. shared: params and policy_params."""
    params, policy_params = shared
    draws = jax.random.split(jax.random.wrap_key_data(progress.keys), 3)
    action = program.policy(policy_params, progress.obs, draws[1])
    obs, state, reward, terminated, truncated, info = pure_step(
        program.env, draws[2], progress.state, action, params
    )
    known = info | {"obs": progress.obs, "action": action, "next_obs": info["final_obs"]}
    kept = {name: known[name] for name in program.keep}
    after = Progress(state, obs, jax.random.key_data(draws[0]))
    return after, (reward, terminated, truncated, kept)


@partial(jax.jit, static_argnums=0)
def _collect(program: _Program, params: Any, policy_params: Any, progress: Progress) -> Collected:
    shared = (params, policy_params)
    if len(progress.obs) <= SMALL:
        run = partial(fused_scan, _one_step, (program,), shared, length=program.steps)
        last, rows = jax.vmap(run, out_axes=(0, 1))(progress)
    else:
        body = jax.vmap(partial(_one_step, program, shared), in_axes=(0, None))
        last, rows = jax.lax.scan(body, progress, None, length=program.steps)
    return Collected(*rows, last)


def _threads(num_envs: int, cores: int | None) -> int:
    """Into how many parts a batch is divided."""
    if cores is not None:
        return min(checks.require_integer("cores", cores, high=4096), num_envs)
    if jax.default_backend() != "cpu":
        return 1
    return max(1, min(cores_here(), num_envs // LEAST_A_CORE))


def cores_here() -> int:
    """Number of this machine's cores that the process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _require_room(program: _Program, params: Any, policy_params: Any, num_envs: int) -> None:
    """ValueError for unknown names, and for results that memory cannot hold."""
    leaves, structure = jax.tree.flatten((params, policy_params))
    shapes = tuple((jnp.shape(leaf), jnp.result_type(leaf)) for leaf in leaves)
    each = _bytes_of_a_step(program, structure, shapes)
    what = f"num_envs = {num_envs} with steps = {program.steps}"
    checks.require_memory(what, "steps", float(num_envs) * program.steps, 2 * each)


@lru_cache(maxsize=256)
def _bytes_of_a_step(program: _Program, structure: Any, shapes: tuple[Any, ...]) -> int:
    """Memory of one environment's returned step [bytes]; ValueError for an unknown entry."""
    leaves = [jax.ShapeDtypeStruct(*each) for each in shapes]
    params, policy_params = jax.tree.unflatten(structure, leaves)
    data = jax.eval_shape(lambda: jax.random.key_data(jax.random.key(0)))
    obs, state, results = abstract_step(program.env, params)
    key = jax.eval_shape(jax.random.wrap_key_data, data)
    action = jax.eval_shape(program.policy, policy_params, obs, key)
    size = (len(program.env.action_names),)
    if getattr(action, "shape", None) != size:
        given = f"the policy's action has shape {getattr(action, 'shape', type(action).__name__)}"
        raise ValueError(f"{given}; accepted: {size}, for {', '.join(program.env.action_names)}")
    checks.require_known(program.keep, ("obs", "action", "next_obs", *results[5]), "name to keep")
    now = Progress(state, obs, data)
    rows = jax.eval_shape(partial(_one_step, program), (params, policy_params), now)[1]
    return sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves(rows))
