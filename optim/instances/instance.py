"""The suite: problems with fixed ids, and their known solutions.

A definition never changes: a change gets a new version.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any
from zlib import crc32

import jax
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.pytrees import given_state, read_only, refuse_after_fork
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.instances.objective import Objective
from stickslip.optim.problem import as_floats

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import Problem, Vector

FAMILIES = {
    "posture": "leg angles of the UGV",
    "split": "torque split (convex)",
    "gait": "gaits (convex)",
    "shooting": "torques through the simulator",
    "gains": "feedback gains (noisy)",
    "design": "designs",
    "goals": "two goals",
}
"""Families of instances."""
HERE = Path(__file__).parent
SUITE, VALUES, POINTS = HERE / "suite.json", HERE / "known.json", HERE / "best.npz"
DRAWS_FROM = 2**32 - 1
"""The first draw of a noisy instance's value; the others count down from it."""
QUIET = 256
"""Draws that a noisy instance's value is the mean of."""
DIGITS = 7
"""Digits of the numbers in a digest."""
AGREED = 1e-3
"""Relative difference of values that agree."""
SEEDED, MOST_SEED = re.compile(r"(.+-v\d+)-s(\d{1,9})"), 10**9 - 1
LATER: dict[str, tuple[float, ...]] = {"works": (0, 1, 3), "efficiency": (1.0,), "free_split": (0,)}
LATER |= {"apart_between": (1,)}
"""Later fields, and values that no digest counts: usual ones, and those that others imply."""


@dataclass(frozen=True)
class Flags:
    """Guaranteed properties. convex: objective and feasible set; smooth: slopes are continuous;
    noisy: each evaluation draws. kinks: where slopes jump at a point that a search may start at."""

    convex: bool = False
    smooth: bool = False
    noisy: bool = False
    kinks: str = ""


@dataclass(frozen=True)
class Known:
    """Known solution of an instance. value: of the best feasible point, whose free numbers are x;
    NaN with several goals. how: what found it; methods: how many came within AGREED of it. bound:
    what no feasible point is below, and why; None. digest: of the instance that this is about.
    front: with several goals, unbeaten values [points, k]."""

    value: float
    how: str
    bound: float | None
    bound_how: str
    digest: str
    methods: int = 1
    x: np.ndarray | None = None
    front: np.ndarray | None = None

    @property
    def standing(self) -> str:
        """How sure the value is: proved, agreed by several methods, or the best that was seen."""
        if self.bound is not None:
            gap = max(0.0, self.value - self.bound) / max(abs(self.value), 1e-12)
            return f"proved within {100.5 * gap:.3g} %"
        return f"agreed by {self.methods} methods" if self.methods > 1 else "best seen"


@dataclass(frozen=True)
class Instance:
    """A problem of the suite. `suite()` has them all.

    id: family, machine, scene, criterion, size and version; a definition never changes under its
    id. what: it in a sentence. goals: name and unit of each value. n: its free numbers. build:
    makes its problems, one for each goal, inside `jax.enable_x64(True)`.
    """

    id: str
    family: str
    what: str
    goals: tuple[str, ...]
    n: int
    build: Callable[..., tuple[Problem[Any], ...]]
    flags: Flags = Flags()

    def __getstate__(self) -> dict[str, Any]:
        return given_state(self)

    @cached_property
    def problems(self) -> tuple[Problem[Any], ...]:
        """One for each goal, of one decision vector under the same constraints."""
        refuse_after_fork()
        with jax.enable_x64(True):
            return self.build()

    @property
    def problem(self) -> Problem[Any]:
        return self.problems[0]

    def value(self, x: Vector) -> tuple[Float[np.ndarray, "k"], bool]:
        """Values of free numbers, and whether they are feasible; of a noisy instance the mean over
        QUIET draws that no objective's seed begins with. Counted nowhere."""
        free = [one.free for one in self.problems]
        x = as_floats("x", x, "finite numbers")
        feasible = free[0].is_feasible(x)
        if isinstance(self.problem, FunctionProblem) and self.flags.noisy:
            whole = np.broadcast_to(free[0].expand(x), (QUIET, self.problem.n))
            draws = DRAWS_FROM - np.arange(QUIET)
            return np.mean(self.problem.at_all(whole, draws)[0], axis=0), feasible
        return np.array([one.objective(x) for one in free]), feasible

    def objective(self, **options: Any) -> Objective:
        """A fresh Objective, whose options these are: budget, seconds, seed, record."""
        own = {"problems": self.problems, "noisy": self.flags.noisy}
        names = [one.name for one in fields(Objective) if one.name not in own]
        checks.require_known(options, names, "option of an objective")
        return Objective(**own, **options)

    @property
    def known(self) -> Known | None:
        """The best value known and what is proved; None where nothing was recorded."""
        if self.id not in _entries():
            return None
        given, points = dict(_entries()[self.id]), _points()
        value = given.pop("value")
        x, front = points.get(self.id), points.get(f"{self.id} front")
        return Known(np.nan if value is None else value, **given, x=x, front=front)

    @property
    def best_known(self) -> float:
        """The best feasible value known; infinite where none is, NaN with several goals."""
        known = self.known
        return np.inf if known is None else known.value

    @property
    def lower_bound(self) -> float | None:
        """Lower bound of every feasible point; None where nothing is proved."""
        return None if self.known is None else self.known.bound

    def digest(self) -> str:
        """Digest of the numbers of its problems, tracks included."""
        found = hashlib.sha256(f"{self.id} {self.goals}".encode())
        for problem in self.problems:
            for part in parts_of(problem):
                found.update(part)
        return found.hexdigest()


def suite(*families: str) -> dict[str, Instance]:
    """All instances by id, or those of some of FAMILIES.

    Making them costs nothing: problems are built when they are used.
    """
    for one in families:
        checks.require_choice("family", one, FAMILIES)
    return {name: one for name, one in _all().items() if not families or one.family in families}


def instance(name: str, seed: int | None = None) -> Instance:
    """The instance with an id. ValueError, with the nearest ids, for an unknown one.

    seed: an instance whose machine, ground, limits and box are drawn near the usual ones. Its id
    ends in "-s" and the seed. Without `known` it may have no feasible point.
    """
    checks.require_kind("id", name, str, "an id of `suite()`")
    if found := SEEDED.fullmatch(name):
        given = f"id = {checks.shown(name)} with seed"
        checks.require_that(seed is None, given, seed, "one of them")
        name, seed = found[1], int(found[2])
    if name not in _all():
        near = checks.nearest(name, _all())
        raise ValueError(
            f"id = {checks.shown(name)} is unknown{near}; accepted: ids of `suite()`, NAME-s7"
        )
    if seed is None:
        return _all()[name]
    return _seeded(name, checks.require_integer("seed", seed, low=1, high=MOST_SEED))


@lru_cache(maxsize=256)
def _seeded(name: str, seed: int) -> Instance:
    one = _all()[name]
    return replace(one, id=f"{name}-s{seed}", build=partial(one.build, seed=seed))


def drawn(seed: int | None, *, spread: float = 0.15, **usual: Any) -> dict[str, Any]:
    """The usual numbers or arrays, each element times a factor of its own, log-uniform from
    1 / (1 + spread) to 1 + spread; without a seed as they are.

    A name's factors depend on the seed and that name alone, so goals of one instance share them.
    """
    if seed is None:
        return usual
    found = dict(usual)
    for name, value in usual.items():
        random = np.random.default_rng([seed, crc32(name.encode())])
        found[name] = value * (1 + spread) ** random.uniform(-1, 1, np.shape(value))
    return found


@cache
def _all() -> dict[str, Instance]:
    """The instances of the file SUITE."""
    found = {}
    for name, given in json.loads(SUITE.read_text("utf-8")).items():
        own = {"build": partial(_built, given["build"]), "goals": tuple(given["goals"])}
        own["flags"] = Flags(**given.get("flags", {}))
        found[name] = Instance(name, **given | own)
    return found


def _built(build: list[dict[str, Any]], seed: int | None = None) -> tuple[Problem[Any], ...]:
    """build: each goal's problem, as module.function of this folder, and its arguments."""
    given = (one | {"seed": seed} for one in build)
    return tuple(resolve_name(f"stickslip.optim.instances.{o.pop('make')}")(**o) for o in given)


def parts_of(value: object) -> list[bytes]:
    """A tree of dataclasses, tuples, mappings and arrays as bytes, field by field.

    Numbers count to DIGITS of the largest of their array, so that roundings of another machine do
    not; functions by their name; fields that a class computes by itself, or that are None, not at
    all, so that an option that comes later changes no digest.
    """
    if is_dataclass(value) and not isinstance(value, type):
        found = [type(value).__name__.encode()]
        for one in sorted(fields(value), key=lambda one: one.name):
            given = getattr(value, one.name)
            if one.init and given is not None and given not in LATER.get(one.name, ()):
                found += [one.name.encode(), *parts_of(given)]
        return found
    if isinstance(value, dict):
        return [one for key in sorted(value) for one in (str(key).encode(), *parts_of(value[key]))]
    if isinstance(value, tuple | list):
        return [part for one in value for part in parts_of(one)]
    if isinstance(value, bool | str | None.__class__ | frozenset):
        names = sorted(map(str, value)) if isinstance(value, frozenset) else value
        return [repr(names).encode()]
    if isinstance(value, int | float | np.ndarray | np.generic | jax.Array):
        array = np.asarray(value, dtype=float)
        size = float(np.max(np.abs(array), initial=0.0)) or 1.0
        whole = np.round(array / size * 10.0**DIGITS).astype(np.int64)
        return [f"{array.shape} {size:.{DIGITS}g}".encode(), whole.tobytes()]
    name = getattr(value, "__qualname__", None)
    if name is None:
        raise TypeError(f"an instance holds a {type(value).__name__}, which has no digest")
    return [name.encode()]


@cache
def _entries() -> dict[str, dict[str, Any]]:
    return json.loads(VALUES.read_text("utf-8"))["instances"]


@cache
def _points() -> dict[str, np.ndarray]:
    with np.load(POINTS, allow_pickle=False) as content:
        return {name: read_only(content[name]) for name in content.files}
