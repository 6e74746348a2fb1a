"""The protocol of the functional environments: pure functions of a key, a state and parameters.

And parts of every environment's parameters: time limit, numbers, ranges that a reset draws from.

`step` returns six values, as gymnax 1.0 does: observation, state, reward, terminated, truncated and
info. Everything jits, vmaps and differentiates; a failure inside a step is a status in info.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Concatenate, Generic, ParamSpec, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.kernels.fused import fused, where_needed
from stickslip.dynamics.pytrees import Lists, Number, Numeric, require_broadcast, require_numeric

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float, Real


AUTORESET = ("same_step", "next_step", "disabled")
MOST_STEPS = 10**7
"""Greatest number of steps of an episode."""
SATURATES = "finite numbers, which saturate beyond [-1, 1]"
"""Accepted actions, for messages."""

Env = TypeVar("Env")
Keywords = ParamSpec("Keywords")
Result = TypeVar("Result")
State = TypeVar("State")
Params = TypeVar("Params")


class FunctionalEnv(ABC, Generic[State, Params]):
    """A pure environment. Subclasses are frozen dataclasses of static choices.

    autoreset: "same_step" returns the next episode's first observation with the step that ends one,
    the last observation being kept in info["final_obs"]; "next_step" resets in the step after,
    which ignores its action and has reward 0; "disabled" leaves resetting to the caller.
    info["autoreset"] is true in the step that resets. No derivative goes through a reset: the new
    episode depends on the key and the parameters alone, info["final_obs"] on the actions before.
    """

    autoreset: str
    action_names: tuple[str, ...]
    params_kind: type = object
    state_kind: type = object
    """The classes of the parameters and of the states."""

    def __new__(cls, *args: object, **options: object) -> FunctionalEnv:
        """Refuse unknown names with those that are known, before the constructor counts them."""
        del args
        if is_dataclass(cls):
            names = [field.name for field in fields(cls) if field.init]
            checks.require_known(options, names, f"option of {cls.__name__}")
        return super().__new__(cls)

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Arguments of `make_params`; () without one."""
        make = getattr(cls, "make_params", None)
        return () if make is None else tuple(inspect.signature(make).parameters)[1:]

    readers: ClassVar[dict[str, Callable[[Any], Any]]] = {}
    """Readers of entries that are no JSON values, by their names."""

    @classmethod
    def from_plain(cls, entries: Entries) -> dict[str, Any]:
        """Arguments of the class, or of `make_params`, from JSON values; numbers stay."""
        readers = cls.readers
        return {k: readers[k](value) if k in readers else value for k, value in entries.items()}

    option_names: tuple[str, ...] = ()
    """Arguments of `episode_params`."""

    def episode_params(self, params: Params, options: Mapping[str, Any]) -> Params:
        """Parameters whose `reset_env` starts as the options of a reset say; steps are the same.

        ValueError for an unknown name and for a value that `make_params` would not take.
        """
        self.check_params(params)
        checks.require_known(options, self.option_names, "option of reset")
        return params

    @property
    @abstractmethod
    def default_params(self) -> Params:
        """The parameters of the standard task."""

    @abstractmethod
    def reset_env(self, key: Array, params: Params) -> tuple[Float[Array, " obs"], State]:
        """A new episode's first observation and state."""

    @abstractmethod
    def step_env(
        self, state: State, action: Float[Array, " act"], params: Params
    ) -> tuple[Float[Array, " obs"], State, Array, Array, Array, dict[str, Any]]:
        """One control step without autoreset."""

    @abstractmethod
    def observation_bounds(self, params: Params) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest value of every observation entry."""

    @abstractmethod
    def pictures(
        self, states: State, infos: Mapping[str, np.ndarray], params: Params
    ) -> Callable[[int], np.ndarray]:
        """The picture [height, width, 3], uint8, of sample i of an episode: its states in a row,
        every leaf [n], and the info of the step that led to each, {} or zeros at a reset."""

    def is_over(self, state: Any) -> Bool[Array, ""]:
        """True if the state's episode has ended: its `over`, unless a subclass says otherwise."""
        return state.over

    def reset(self, key: Array, params: Params) -> tuple[Float[Array, " obs"], State]:
        """Begin an episode: observation and state. `key`: a JAX random key."""
        self.check_params(params)
        checks.require_kind("key", key, jax.Array, "a JAX random key, as jax.random.key(0)")
        return _jit_reset(self, key, params)

    def step(
        self, key: Array, state: State, action: Real[Number, " act"] | Lists, params: Params
    ) -> tuple[
        Float[Array, " obs"],
        State,
        Float[Array, ""],
        Bool[Array, ""],
        Bool[Array, ""],
        dict[str, Any],
    ]:
        """One control step: observation, state, reward, terminated, truncated, info.

        action: one number for each of `action_names`, which saturates beyond [-1, 1] as a motor
        does. key: used only if this step resets (the new episode is then `reset(key, params)`).
        ValueError for an action of the wrong shape and, unless traced, for one that is not finite.
        """
        self.check_params(params)
        checks.require_kind("state", state, self.state_kind, "a state, as reset and step give it")
        return _jit_step(self, key, state, jnp.asarray(self.check_action(action)), params)

    def check_params(self, params: object, name: str = "params") -> None:
        """Raise ValueError for parameters of another environment. name: what the message says."""
        accepted = f"a {self.params_kind.__name__}, as make_params gives it"
        checks.require_kind(name, params, self.params_kind, accepted)
        kinds = {leaf.dtype for leaf in jax.tree.leaves(params) if isinstance(leaf, jax.Array)}
        checks.require_precision(name, *kinds)

    def check_action(self, action: Any, batch: tuple[int, ...] = ()) -> Any:
        """Return the action saturated to [-1, 1], a traced one unchanged.

        action: [*batch, act]; batch: () or (n,). Raises ValueError for another shape and for a
        number that is not finite, with its place.
        """
        plain = type(action) is np.ndarray and action.dtype.kind in "fiu"
        concrete = plain or checks.is_concrete(action)
        values = checks.as_real("action", action, SATURATES) if concrete and not plain else action
        shape = (*batch, len(self.action_names))
        if np.shape(values) != shape:
            accepted = f"{shape}, one number for each of {', '.join(self.action_names)}"
            raise ValueError(f"action has shape {np.shape(values)}; accepted: {accepted}")
        if not concrete or (np.abs(values) <= 1).all():  # false for NaN
            return values
        for place in np.argwhere(~np.isfinite(values)).tolist():
            given = values[tuple(place)]
            raise ValueError(f"action{place} = {given} is not accepted; accepted: {SATURATES}")
        return np.clip(values, -1, 1)

    def __post_init__(self):
        checks.require_choice("autoreset", self.autoreset, AUTORESET)


def with_keywords_of(
    function: Callable[Concatenate[Any, Keywords], Result],
) -> Callable[
    [Callable[Concatenate[Env, ...], Result]], Callable[Concatenate[Env, Keywords], Result]
]:
    """Give a method that takes any keywords the signature of the function that it calls."""

    def decorate(method: Any) -> Any:
        keywords = inspect.signature(function).parameters.values()
        given = [one for one in keywords if one.kind is one.KEYWORD_ONLY]
        own = inspect.signature(method)
        method.__signature__ = own.replace(parameters=[own.parameters["self"], *given])
        return method

    return decorate


def bare_step(
    env: FunctionalEnv[State, Params],
    key: Any,
    state: State,
    action: Float[Array, " act"],
    params: Params,
):
    """`FunctionalEnv.step` without checks, for use inside what is fused already."""
    action = jnp.clip(jnp.asarray(action), -1.0, 1.0)
    obs, after, reward, terminated, truncated, info = _step_env(env, state, action, params)
    info = info | {"final_obs": obs, "autoreset": jnp.zeros_like(terminated)}
    if env.autoreset == "disabled":
        return obs, after, reward, terminated, truncated, info
    if env.autoreset == "same_step":
        over = terminated | truncated
        obs, after = where_needed(over, env.reset_env, (key, params), (obs, after))
        return obs, after, reward, terminated, truncated, info | {"autoreset": over}
    over = env.is_over(state)
    fresh_obs, fresh = env.reset_env(key, params)
    result = obs, after, reward, terminated, truncated, info
    nothing = jax.tree.map(jnp.zeros_like, (reward, terminated, truncated, info))
    reset = fresh_obs, fresh, *nothing[:3], nothing[3] | {"final_obs": fresh_obs, "autoreset": over}
    return jax.tree.map(partial(jnp.where, over), reset, result)


def abstract_step(env: FunctionalEnv[State, Params], params: Any) -> tuple[Any, State, Any]:
    """Shapes and types of a reset's observation and state, and of a step's results."""
    key = jax.eval_shape(lambda: jax.random.key(0))
    obs, state = jax.eval_shape(env.reset_env, key, params)
    action = jax.ShapeDtypeStruct((len(env.action_names),), obs.dtype)
    return obs, state, jax.eval_shape(partial(bare_step, env), key, state, action, params)


_step_env = fused(lambda env, *given: env.step_env(*given), fixed=1)
"""A kernel of its own where the reset is none: rough ground that is drawn anew."""
pure_step = fused(bare_step, fixed=1)
"""`FunctionalEnv.step` without checks, for use inside a trace: `pure_step(env, key, state, action,
params)`, one kernel of a processor (see `fused`)."""
_jit_reset = jax.jit(lambda env, key, params: env.reset_env(key, params), static_argnums=0)
_jit_step = jax.jit(pure_step, static_argnums=0)


AnyEnv = FunctionalEnv[Any, Any]
"""Some machine's environment."""
Plain = bool | int | float | str | list[object] | dict[str, object] | None
"""A JSON value."""
Entries = Mapping[str, Any]
"""Plain values by name, read."""


def with_tuples(entries: Entries) -> dict[str, Any]:
    """Arguments of which lists are ranges, which are tuples."""
    return {name: tuple(one) if isinstance(one, list) else one for name, one in entries.items()}


class Timed(Protocol):
    """Protocol of every environment's parameters."""

    @property
    def control_period(self) -> Number:
        """Duration of a step [s]."""
        ...

    @property
    def time_limit(self) -> Number:
        """Duration of an episode [s]."""
        ...


HALF = 0.501
"""Periods before its time limit at which an episode is over: 0.5, not to be decided by rounding."""


def horizon(params: Timed) -> int:
    """Control steps to the time limit. params: concrete numbers."""
    steps = np.asarray(params.time_limit, float) / np.asarray(params.control_period, float)
    count = float(np.max(steps))
    if not count <= MOST_STEPS:
        raise ValueError(
            f"time_limit = {checks.shown(params.time_limit)} with control_period = "
            f"{checks.shown(params.control_period)} makes {count:.3g} steps; accepted: at most "
            f"{MOST_STEPS:g}"
        )
    return max(1, int(np.ceil(count - HALF)))


Rule = Mapping[str, Any]
"""Keywords of `require_number`; a number may be None where "accepted" begins with it."""
POSITIVE: Rule = {"low": 0.0, "strict": True, "accepted": "finite, > 0"}
NON_NEGATIVE: Rule = {"low": 0.0, "accepted": "finite, >= 0"}


def as_numbers(given: Mapping[str, Any], rules: Mapping[str, Rule]) -> dict[str, Any]:
    """The entries with numbers as pytrees hold them; ValueError naming a bad one."""
    ruled = [name for name, value in given.items() if not _is_none(name, value, rules)]
    return {**given} | {name: checks.as_number(name, given[name], **rules[name]) for name in ruled}


def require_numbers(params: Any, rules: Mapping[str, Rule], dtype: Any) -> None:
    """Raise ValueError unless the parameters that the rules name keep them and broadcast."""
    numbers = {name: getattr(params, name) for name in rules}
    numbers = {name: one for name, one in numbers.items() if not _is_none(name, one, rules)}
    require_numeric(**numbers)
    for name, value in numbers.items():
        checks.require_number(name, value, **rules[name], dtype=dtype)
    require_broadcast(**numbers)


def _is_none(name: str, value: object, rules: Mapping[str, Rule]) -> bool:
    """True for None where it is accepted, and for entries without a rule."""
    return name not in rules or (value is None and rules[name]["accepted"].startswith("None"))


Range = tuple[Numeric, Numeric]


def uniform(key: Array, bounds: Range, dtype: DTypeLike, shape: tuple[int, ...] = ()):
    """Numbers of that shape, each even in the range (low, high)."""
    low, high = (jnp.asarray(bound, dtype) for bound in bounds)
    return low + (high - low) * jax.random.uniform(key, shape, dtype)


def noisy(values: Array, deviation: Any, chain: Array | None, elapsed: Array) -> Array:
    """Values with normal errors of that deviation, new ones in each step; None: without.

    chain: random key, as plain numbers.
    """
    if chain is None or deviation is None:
        return values
    key = jax.random.fold_in(jax.random.wrap_key_data(chain), elapsed)
    return values + deviation * jax.random.normal(key, values.shape, values.dtype)


def require_range(
    name: str,
    given: Any,
    low: float = -np.inf,
    strict: bool = False,
    optional: bool = True,
    high: float = np.inf,
) -> None:
    """Raise ValueError unless `given` is (low, high), finite and in order, or None if optional."""
    if given is None and optional:
        return
    accepted = f"(low, high), finite, low <= high, low {'>' if strict else '>='} {low}"
    accepted += f", high <= {high}" if high < np.inf else ""
    if not isinstance(given, tuple) or len(given) != 2:
        raise ValueError(f"{name} = {checks.shown(given)} is no range; accepted: {accepted}")
    for end in given:
        checks.require_number(name, end, low=low, high=high, strict=strict, accepted=accepted)
        require_numeric(**{name: end})
    require_broadcast(**{f"{name}[0]": given[0], f"{name}[1]": given[1]})
    if checks.is_concrete(given) and np.any(np.asarray(given[0]) > np.asarray(given[1])):
        raise ValueError(f"{name} = {checks.shown(given)} has low > high; accepted: {accepted}")
