"""Instance of the suite: a problem with a fixed id, and its known solution."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.numeric import read_only
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.instances.objective import Objective
from stickslip.optim.options import refuse_after_fork
from stickslip.optim.problem import given_state
from stickslip.records.files import write_whole
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Float

    from stickslip.optim.problem import AnyProblem

HERE = Path(__file__).parent
VALUES, POINTS = "known.json", "best.npz"
DRAWS_FROM = 2**32 - 1
"""The first draw of a noisy instance's value; the others count down from it."""
QUIET = 256
"""Draws that a noisy instance's value is the mean of."""

SAME = 1e-6
"""Relative tolerance of a recorded value: roundings of another machine."""
DIGITS = 7
"""Digits of the numbers in a digest."""


@dataclass(frozen=True)
class Flags:
    """Guaranteed properties. convex: objective and feasible set; smooth: slopes are continuous;
    lipschitz: no jumps; noisy: each evaluation draws; separable: the objective is a sum (or the
    largest) of terms of one number each; slopes: gradient and jacobian can be asked for."""

    convex: bool = False
    smooth: bool = False
    lipschitz: bool = True
    noisy: bool = False
    separable: bool = False
    slopes: bool = True


@dataclass(frozen=True)
class Known:
    """Known solution of an instance. value: of the best feasible point, whose free numbers are x;
    NaN with several goals. how: what found it. bound: what no feasible point is below, and why;
    None. digest: of the instance that this is about. front: with several goals, unbeaten values
    [points, k]. cost: microseconds of an evaluation, by kind of call."""

    value: float
    how: str
    bound: float | None
    bound_how: str
    digest: str
    cost: dict[str, float]
    x: np.ndarray | None = None
    front: np.ndarray | None = None


@dataclass(frozen=True)
class Instance:
    """A problem of the suite. `suite()` has them all.

    id: family, machine, scene, criterion, size and version; a definition never changes under its
    id. what: it in a sentence. goals: name and unit of each value. flags: see Flags. n: its free
    numbers. build: makes its problems, one for each goal.
    """

    id: str
    family: str
    what: str
    goals: tuple[str, ...]
    flags: Flags
    n: int
    build: Callable[[], tuple[AnyProblem, ...]]

    def __getstate__(self) -> dict[str, Any]:
        return given_state(self)

    @cached_property
    def problems(self) -> tuple[AnyProblem, ...]:
        """One for each goal, of one decision vector under the same constraints."""
        refuse_after_fork()
        with jax.enable_x64(True):
            return self.build()

    @property
    def problem(self) -> AnyProblem:
        """The first of them, or the only one."""
        return self.problems[0]

    def value(self, x: Float[np.ndarray, "n"]) -> tuple[Float[np.ndarray, "k"], bool]:
        """Values of free numbers, and whether they are feasible; of a noisy instance the mean over
        QUIET draws that no objective's seed begins with. Counted nowhere."""
        free = [one.free for one in self.problems]
        x = np.asarray(x, float)
        feasible = free[0].is_feasible(x)
        if isinstance(self.problem, FunctionProblem) and self.flags.noisy:
            whole = np.broadcast_to(free[0].expand(x), (QUIET, self.problem.n))
            draws = DRAWS_FROM - np.arange(QUIET)
            return np.mean(self.problem.at_all(whole, draws)[0], axis=0), feasible
        return np.array([one.objective(x) for one in free]), feasible

    def objective(self, **options: Any) -> Objective:
        """A fresh Objective, whose options these are: budget, seconds, outside, targets, seed."""
        return Objective(self.problems, noisy=self.flags.noisy, **options)

    @property
    def known(self) -> Known | None:
        """The best value known and what is proved; None where nothing was recorded."""
        return known_of(self.id)

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


def made(name: str, *builds: Callable[[], AnyProblem], version: int = 1, **rest: Any) -> Instance:
    """An instance under a name without its version. builds: each makes a goal's problem; rest: the
    other fields."""
    return Instance(id=f"{name}-v{version}", build=partial(_built, builds), **rest)


def _built(builds: tuple[Callable[[], AnyProblem], ...]) -> tuple[AnyProblem, ...]:
    return tuple(build() for build in builds)


def verified(instance: Instance) -> str:
    """ "as recorded", with what is, or what differs: the instance, its value, its feasibility."""
    known = instance.known
    if known is None:
        return "nothing is recorded"
    if instance.digest() != known.digest:
        return "another instance than the recorded one: its numbers differ"
    if known.x is None:
        return "no point is recorded"
    found = [instance.value(one) for one in np.atleast_2d(known.x)]
    values = np.array([at[0] for at in found])
    wanted = known.value if known.front is None else known.front
    if not all(at[1] for at in found):
        return "the recorded point is not feasible"
    if not np.allclose(values, wanted, rtol=SAME, atol=SAME):
        return f"{values} at the recorded point, recorded {wanted}"
    bound = known.bound
    return "as recorded" + ("" if bound is None else f", {bound:.8g} at least: {known.bound_how}")


def parts_of(value: object) -> list[bytes]:
    """A tree of dataclasses, tuples, mappings and arrays as bytes, field by field.

    Numbers count to DIGITS of the largest of their array, so that roundings of another machine do
    not; functions by their name; fields that a class computes by itself, or that are None, not at
    all, so that an option that comes later changes no digest.
    """
    if is_dataclass(value) and not isinstance(value, type):
        found = [type(value).__name__.encode()]
        for one in sorted(fields(value), key=lambda one: one.name):
            if one.init and (given := getattr(value, one.name)) is not None:
                found += [one.name.encode(), *parts_of(given)]
        return found
    if isinstance(value, dict):
        return [
            part for key in sorted(value) for part in (str(key).encode(), *parts_of(value[key]))
        ]
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


def known_of(name: str) -> Known | None:
    """Recorded solution of an instance; None where there is none."""
    entry = _entries().get(name)
    if entry is None:
        return None
    points = _points()
    x, front = points.get(name), points.get(f"{name} front")
    value = np.nan if entry["value"] is None else entry["value"]
    rest = {key: given for key, given in entry.items() if key not in ("value", "cost")}
    return Known(value, **rest, cost=dict(entry["cost"]), x=x, front=front)


def keep(name: str, known: Known, here: Path = HERE) -> None:
    """Write what is known of an instance beside the others, whole."""
    entries, points = dict(_entries(here)), dict(_points(here))
    entry = {one: getattr(known, one) for one in ("how", "bound", "bound_how", "digest", "cost")}
    value = None if np.isnan(known.value) else known.value
    entries[name] = {"value": value, **entry}
    for key, array in ((name, known.x), (f"{name} front", known.front)):
        points.pop(key, None)
        if array is not None:
            points[key] = array
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **dict(sorted(points.items())))
    write_whole(here / POINTS, stream.getvalue())
    write_whole(
        here / VALUES, json_text({"format": "stickslip known optima", "instances": entries})
    )
    _entries.cache_clear()
    _points.cache_clear()


@cache
def _entries(here: Path = HERE) -> dict[str, dict[str, Any]]:
    file = here / VALUES
    return json.loads(file.read_text("utf-8"))["instances"] if file.is_file() else {}


@cache
def _points(here: Path = HERE) -> dict[str, np.ndarray]:
    file = here / POINTS
    if not file.is_file():
        return {}
    with np.load(file, allow_pickle=False) as content:
        return {name: read_only(content[name]) for name in content.files}
