"""On which task each of those named on the command line is shown: a policy on its own."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import jax
import numpy as np

from stickslip.agents.policy.file import policy_path, read_policy
from stickslip.dynamics.checks import nearest

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


class Kind(Protocol):
    """What the commands have to know of a machine's tasks."""

    ENVIRONMENT: str
    """Name of the environment's class."""
    FOREIGN: tuple[str, ...]
    """Flags of the other machine."""
    BASELINES: tuple[str, ...]

    def read_task(self, metadata: Mapping[str, Any]) -> Any:
        """The task that a policy's file holds; None if it holds none."""
        ...

    def standard_task(self, metadata: Mapping[str, Any]) -> Any:
        """The one for a policy whose file holds none, and for baselines alone ({})."""
        ...

    def with_options(self, task: Any, given: Mapping[str, Any], scene: str | None) -> Any:
        """The task with what the flags ask for instead."""
        ...

    def params_from(self, task: Any, start: str | None, usual: str) -> Any:
        """The environment's parameters; start: a flag's, usual: where there is none."""
        ...

    def label_of(self, task: Any, scene: str | None) -> str:
        """A few words for a row."""
        ...

    def details_of(self, task: Any) -> str:
        """The numbers in a line."""
        ...

    def baseline(self, name: str, env: Any) -> Any:
        """A baseline for an environment."""
        ...


class Named(NamedTuple):
    """A policy with what its file says, or a baseline (None, {})."""

    policy: Any
    metadata: dict[str, Any]


@dataclass
class Place:
    """One task with those who are to do it there."""

    label: str
    details: str
    params: Any
    who: dict[str, Any] = field(default_factory=dict)
    """The environment of each, which shows it what it was trained on."""
    origins: list[str] = field(default_factory=list)

    def line(self) -> str:
        """What the task is and whose."""
        return f"{self.label}: {', '.join(dict.fromkeys(self.origins))}\n  {self.details}"


def read_named(who: Sequence[str], kind: Kind) -> dict[str, Named]:
    """Policies and baselines by name. ValueError for anything else, or another machine's policy."""
    found: dict[str, Named] = {}
    for name in who:
        if name in kind.BASELINES:
            found[name] = Named(None, {})
            continue
        path = policy_path(name)
        if not path.exists():
            raise ValueError(
                f"{name!r} is neither a baseline nor a file; accepted: {', '.join(kind.BASELINES)}"
                ", a policy file, or the directory of a run with one"
                f"{nearest(name, kind.BASELINES)}"
            )
        policy, metadata = read_policy(path)
        machine = metadata.get("environment", kind.ENVIRONMENT)
        if machine != kind.ENVIRONMENT:
            raise ValueError(
                f"{name!r} is a policy of {machine}; accepted: policies of one machine"
            )
        found[name] = Named(policy, metadata)
    return found


def places_of(
    named: Mapping[str, Named], given: Mapping[str, Any], kind: Kind, usual: str
) -> list[Place]:
    """The tasks: each policy's own with the flags' changes, equal ones once, for every scene named.

    A baseline is shown on every one of them, on the standard task if there is no policy.
    """
    require_flags(given, kind)
    tasks = {name: _own(name, one, kind) for name, one in named.items() if one.policy is not None}
    if not tasks:
        tasks = {"": (kind.standard_task({}), "the standard task")}
    places: list[Place] = []
    for scene in given["scenes"] or [None]:
        for name, (task, origin) in tasks.items():
            changed = kind.with_options(task, given, scene)
            params = kind.params_from(changed, given["start"], usual)
            env = replace(changed.env, autoreset="disabled")
            place = _place_for(places, params, env)
            if place is None:
                label = kind.label_of(changed, scene)
                place = Place(label, kind.details_of(changed), params, {"": env})
                places.append(place)
            if name:
                place.who[name] = env
            place.origins.append(origin + _changes(given, scene))
    return [_settled(place, named, places) for place in places]


def require_flags(given: Mapping[str, Any], kind: Kind) -> None:
    """Raise ValueError for flags of the other machine, and for flags that contradict each other."""
    for name in kind.FOREIGN:
        if given[name] is not None:
            flag, other = _flag(name), "UGV" if kind.ENVIRONMENT == "BipedEnv" else "biped"
            raise ValueError(
                f"{flag} is for the {other}; accepted: a policy or baseline of the {other}"
            )
    if given["mu_static"] is not None and given["scenes"]:
        raise ValueError(
            f"--mu-static {given['mu_static']:g} with --scene {' '.join(given['scenes'])}; "
            "accepted: one of them, both say which floor"
        )
    if given["mu_kinetic"] is not None and given["mu_static"] is None:
        raise ValueError(
            f"mu_kinetic = {given['mu_kinetic']:g} without mu_static; accepted: both, mu_static "
            "alone or neither"
        )


def _own(name: str, one: Named, kind: Kind) -> tuple[Any, str]:
    try:
        task = kind.read_task(one.metadata)
    except ValueError as error:
        raise ValueError(
            f"{policy_path(name)}: {error}; accepted: a task as training wrote it"
        ) from error
    if task is not None:
        return task, f"the own task of {name}"
    why = one.metadata.get("task_missing")
    reason = f", {why}" if isinstance(why, str) else ""
    return kind.standard_task(one.metadata), f"the standard task: {name} holds none{reason}"


def _place_for(places: list[Place], params: Any, env: Any) -> Place | None:
    """The place with exactly these parameters and an environment that computes the same."""
    for place in places:
        first = next(iter(place.who.values()))
        if _blind(first) == _blind(env) and _equal(place.params, params):
            return place
    return None


def _blind(env: Any) -> Any:
    """The environment without what only changes what is observed."""
    for name in ("see_friction", "see_patch"):
        if hasattr(env, name):
            env = replace(env, **{name: False})
    return replace(env, preview=0) if hasattr(env, "preview") else env


def _equal(one: Any, other: Any) -> bool:
    if jax.tree.structure(one) != jax.tree.structure(other):
        return False
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


def _settled(place: Place, named: Mapping[str, Named], places: list[Place]) -> Place:
    """With the baselines among those who are shown, in the order given, and a label of its own."""
    first = next(iter(place.who.values()))
    who = {
        name: place.who.get(name, first)
        for name, one in named.items()
        if one.policy is None or name in place.who
    }
    if sum(other.label == place.label for other in places) > 1:
        owner = next((name for name in place.who if name), "standard")
        return replace(place, label=f"{place.label} (of {owner})", who=who)
    return replace(place, who=who)


def _changes(given: Mapping[str, Any], scene: str | None) -> str:
    """The flags that changed the task, in words."""
    names = ("mu_static", "mu_kinetic", "payload", "commanded_rate", "start", "friction")
    words = [] if scene is None else [f"--scene {scene}"]
    for name in (*names, "criterion"):
        if given[name] is not None:
            words.append(f"{_flag(name)} {given[name]}")
    return f" with {' '.join(words)}" if words else ""


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def named_controller(one: Named, name: str, env: Any, kind: Kind) -> Any:
    """The policy or baseline of a name."""
    return kind.baseline(name, env) if one.policy is None else one.policy


def same_unit(places: Sequence[Place], unit: Callable[[Any], str]) -> None:
    """Raise ValueError for places that cannot stand in one table."""
    units = {unit(env) for place in places for env in place.who.values()}
    if len(units) > 1:
        raise ValueError(
            f"policies trained for {' and '.join(sorted(units))} in one table; accepted: policies "
            "of one criterion, --criterion, or one at a time"
        )
