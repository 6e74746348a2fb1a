"""One episode of a controller as a compiled scan, and the checks of who plays it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Controller, Env, Memoryless, Params, Planner, State, State_co
from stickslip.dynamics.checks import require_integer, require_kind, require_memory, shown
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.envs.functional import MOST_STEPS, AnyEnv, FunctionalEnv, Timed, horizon, pure_step

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

    from stickslip.agents.protocol import Player

STEP_BYTES = 300
"""Memory of a step of an episode while episodes are played side by side."""
MOST_EPISODES = 65536
"""Most episodes of each controller in each scene."""
VALIDATION_SEEDS = 2**31
"""Seeds of validation episodes, from here on: neither training nor a score uses these."""
T = TypeVar("T")
Kept = TypeVar("Kept")


class Rollout(NamedTuple, Generic[State_co]):
    """An episode of at most n control steps; a step's row holds what it led to.

    After the episode's end the last row stands; `length` rows are real. `trimmed` cuts the rest.
    """

    start_state: State_co
    """The environment's state; `state` below, too."""
    start_obs: Float[Array, " obs"]
    state: State_co
    """After each step; every leaf [n]."""
    obs: Float[Array, "n obs"]
    """After each step, the one that ends the episode included."""
    action: Float[Array, "n act"]
    reward: Float[Array, " n"]
    terminated: Bool[Array, " n"]
    truncated: Bool[Array, " n"]
    info: dict[str, Array]
    """Info of the environment's steps, without final_obs and autoreset; every entry [n]."""
    length: Int[Array, ""]

    def trimmed(self) -> Rollout[State_co]:
        """The same as NumPy arrays without the rows after the end, for one episode."""
        here = jax.tree.map(np.asarray, self)
        end = int(here.length)
        rows = jax.tree.map(lambda leaf: leaf[:end], here[2:-1])
        return Rollout(*here[:2], *rows, here.length)  # pyright: ignore[reportCallIssue]


Keep: TypeAlias = Callable[[Rollout, Any], Kept]
"""What is kept of an episode with its parameters; traced."""


def rollout(
    env: FunctionalEnv[State, Params],
    controller: Controller[Any, State, Params],
    params: Params,
    key: Array | int,
    steps: int | None = None,
) -> Rollout[State]:
    """One episode of an environment with a time limit (BipedEnv, UGVEnv).

    key: a JAX random key given to the reset, or a seed as every adapter takes it.
    steps: the most control steps to take, by default up to the time limit. Pure: vmap over key,
    params or the controller's numbers, then with `steps` given. env.autoreset is ignored.
    """
    require_kind("env", env, FunctionalEnv, "a BipedEnv, a UGVEnv or another functional one")
    env.check_params(params)
    validated("controller", controller, Controller)
    if isinstance(key, int | np.integer):
        key = episode_key(require_integer("key", key, low=0, high=2**32 - 1))
    require_kind("key", key, jax.Array, "an integer from 0 to 2**32 - 1, or a key of jax.random")
    count = horizon(params) if steps is None else require_integer("steps", steps, high=MOST_STEPS)
    return _rollout(without_resets(env), count, controller, params, key)


def without_resets(env: Env) -> Env:
    """The environment that leaves resetting to the caller."""
    return replace(env, autoreset="disabled")  # pyright: ignore[reportArgumentType], a dataclass


def episode_key(seed: Array | int) -> Array:
    """The key of a seed's first episode, the same in every adapter (see envs/packed.py)."""
    return jax.random.split(jax.random.key(seed))[1]


episode_keys = jax.jit(jax.vmap(episode_key))
"""The keys of seeds [n]."""


def first_state(env: AnyEnv, params: Timed, seed: int) -> Any:
    """The state in which a seed's first episode begins."""
    return env.reset(episode_key(seed), params)[1]


def planned(env: AnyEnv, controller: Player, params: Timed, seed: int) -> Controller:
    """The path of a planner for a seed's first episode; any other controller as it is."""
    if isinstance(controller, Planner):
        return controller.path(env, params, first_state(env, params, seed))
    return controller


def require_places(env: AnyEnv, scenes: Mapping[str, object]) -> None:
    """Raise ValueError unless these are an environment and its parameters by name."""
    require_kind("env", env, FunctionalEnv, "a BipedEnv, a UGVEnv or another functional one")
    require_named("scenes", scenes, f"{{name: parameters of the {type(env).__name__}}}")
    for name, params in scenes.items():
        env.check_params(params, f"scenes[{name!r}]")


def require_named(name: str, given: object, accepted: str) -> None:
    """Raise ValueError unless `given` is a dict, or like one, of things by name, one at least."""
    require_kind(name, given, Mapping, f"a dict, {accepted}")
    if not given:
        raise ValueError(f"{name} is empty; accepted: at least one")
    for key in given if isinstance(given, Mapping) else ():
        require_kind(f"a name in {name}", key, str, "text")


def validated(name: str, given: T, kinds: type | tuple[type, ...] = (Controller, Planner)) -> T:
    """A controller or planner that validated itself. ValueError for anything else."""
    if isinstance(given, type) and hasattr(given, "validate"):
        raise ValueError(f"{name} = {shown(given)} is a class; accepted: {given.__name__}(...)")
    accepted = "a controller (init, act and validate; help(stickslip.agents.Controller))"
    require_kind(name, given, kinds, accepted if kinds is Controller else f"{accepted} or planner")
    return given.validate()  # pyright: ignore[reportAttributeAccessIssue], a protocol of both


@pytree_dataclass
class Idle(Memoryless):
    """Every action is 0: no torque, or legs held. width: numbers in an action (static)."""

    width: int = field(default=1, metadata={"static": True})

    def validate(self) -> Idle:
        require_integer("width", self.width, high=10**4)
        return self

    def act(
        self, memory: None, obs: Float[Array, " obs"], env_state: object, env_params: object
    ) -> tuple[None, Float[Array, " act"]]:
        """See Controller."""
        return memory, jnp.zeros(self.width, obs.dtype)


@partial(jax.jit, static_argnums=(0, 1))
def _rollout(
    env: AnyEnv, count: int, controller: Controller, params: Timed, key: PRNGKeyArray
) -> Rollout:
    start_obs, start = env.reset_env(key, params)
    unused = jax.random.key(0)  # a step draws nothing when it does not reset

    def advance(last: tuple[Any, ...], memory: Any) -> tuple[Any, tuple[Any, ...]]:
        """The row after a control step, with entries as Rollout has them from `state` to `info`."""
        state, obs = last[:2]
        with _made_for(env, state, params):
            memory, action = controller.act(memory, obs, state, params)
        _require_size(env, action)
        obs, state, *outcome, info = pure_step(env, unused, state, action, params)
        info = {name: info[name] for name in info if name not in ("final_obs", "autoreset")}
        return memory, (state, obs, action, *outcome, info)

    with _made_for(env, start, params):
        memory = controller.init(params, start)
    shapes = jax.eval_shape(lambda: advance((start, start_obs), memory)[1])
    blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)

    def body(carry: tuple[tuple[Any, ...], Any, Int[Array, ""]], _: None):
        last, memory, length = carry
        over = env.is_over(last[0])
        new_memory, row = advance(last, memory)
        row, memory = jax.tree.map(partial(jnp.where, over), (last, memory), (row, new_memory))
        return (row, memory, length + (~over).astype(length.dtype)), row

    begun = (start, start_obs, *blank[2:]), memory, jnp.zeros((), jnp.int32)
    (_, _, length), rows = jax.lax.scan(body, begun, None, length=count)
    return Rollout(start, start_obs, *rows, length=length)


@contextmanager
def _made_for(env: AnyEnv, state: object, params: object) -> Iterator[None]:
    """Inside, reading what a state or parameters of this environment lack is a ValueError."""
    try:
        yield
    except AttributeError as error:
        if not isinstance(error.obj, (type(state), type(params))):
            raise
        raise ValueError(
            f"the controller reads {error.name!r} of a {type(error.obj).__name__}, which lacks it; "
            f"accepted: a controller made for {type(env).__name__}"
        ) from error


def require_fitting(env: AnyEnv, controller: Any, params: Timed) -> None:
    """Raise ValueError unless the controller's action has the environment's shape."""

    def first(controller: Controller, params: Timed) -> Array:
        obs, state = env.reset_env(jax.random.key(0), params)
        with _made_for(env, state, params):
            return controller.act(controller.init(params, state), obs, state, params)[1]

    _require_size(env, jax.eval_shape(first, controller, params))


def _require_size(env: AnyEnv, action: Array) -> None:
    if jnp.shape(action) != (size := (len(env.action_names),)):
        raise ValueError(
            f"the controller's action has shape {jnp.shape(action)}; accepted: {size}, for "
            f"{', '.join(env.action_names)}: it was made for another machine"
        )


def seeds_of(episodes: int, seeds: Sequence[int] | None) -> tuple[int, ...]:
    """The seeds of an evaluation, by default 0, 1, ..., episodes - 1. ValueError for none."""
    if seeds is None:
        return tuple(range(require_integer("episodes", episodes, high=MOST_EPISODES)))
    require_kind("seeds", seeds, Iterable, "whole numbers >= 0 in a list")
    found = tuple(require_integer("seeds", seed, low=0, high=2**32 - 1) for seed in seeds)
    if not found:
        raise ValueError("seeds is empty; accepted: at least one")
    return found


def play(
    env: AnyEnv, controller: Player, params: Timed, seeds: Sequence[int], keep: Keep[Kept]
) -> Kept:
    """Run the seeds' episodes; kept data as NumPy arrays. A planner plans each of them."""
    count, what = horizon(params), f"episodes = {len(seeds)}"
    require_memory(what, f"episodes of {count} steps", len(seeds), count * STEP_BYTES)
    keys = episode_keys(np.asarray(seeds, np.uint32))
    axis, controller = paths(env, controller, params, seeds)
    env = without_resets(env)  # one program, whatever the environment does at an end
    return jax.tree.map(np.asarray, _play(env, count, keep, axis, controller, params, keys))


def paths(
    env: AnyEnv, controller: Player, params: Timed, seeds: Sequence[int]
) -> tuple[int | None, Controller]:
    """What plays the seeds' episodes, and its axis over them: a planner's paths, stacked, or the
    controller itself without an axis."""
    if not isinstance(controller, Planner):
        return None, controller
    found = [planned(env, controller, params, seed) for seed in seeds]
    return 0, jax.tree.map(lambda *leaves: jnp.stack(leaves), *found)


def play_unseen(
    env: AnyEnv, policy: Player, params: Timed, episodes: int, keep: Keep[Kept]
) -> Kept:
    """Play whole validation episodes; one where a reset draws nothing."""
    seeds = range(VALIDATION_SEEDS, VALIDATION_SEEDS + (episodes if is_random(env, params) else 1))
    return play(env, policy, params, seeds, keep)


def is_random(env: AnyEnv, params: Timed) -> bool:
    """True if a reset draws anything: the parameters have a randomisation, or two resets differ."""
    if jax.tree.leaves(getattr(params, "randomisation", None)):
        return True
    first, other = (jax.tree.leaves(env.reset(episode_key(seed), params)) for seed in (0, 1))
    return not all(map(partial(np.array_equal, equal_nan=True), first, other))


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _play(
    env: AnyEnv,
    count: int,
    keep: Keep[Kept],
    axis: int | None,
    controller: Controller,
    params: Timed,
    keys: PRNGKeyArray,
) -> Kept:
    def one(controller: Controller, key: PRNGKeyArray) -> Kept:
        return keep(rollout(env, controller, params, key, count), params)

    return jax.vmap(one, (axis, 0))(controller, keys)
