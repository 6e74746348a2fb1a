"""One objective for every optimiser: it counts, keeps what was best, and ends at its budget."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics.checks import as_real, require_integer, require_kind
from stickslip.dynamics.pytrees import given_state, read_only
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.problem import FEASIBLE, Problem, Structure, require_scalar, shortfall

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import FreeProblem

PENALTY = 1e3
"""Penalty of a violated scaled constraint, in the objective's unit."""
A_DRAW = 1_000_003
"""Draws of one seed begin so far from those of the next."""


class BudgetSpent(Exception):  # noqa: N818 (an end, no error)
    """An optimiser asked for more than its budget, or after its time; what it found is kept.

    `Objective.minimise` takes it as the end; a loop of one's own may do the same.
    """


class Improvement(NamedTuple):
    """A feasible point better than all before. evaluations, seconds: by then; value: its own."""

    evaluations: int
    seconds: float
    value: float


@dataclass
class Record:
    """Counters, and the best so far. Grows while an `Objective` is used.

    values, gradients: how often these were asked for; repeated: values that were asked for again at
    the point evaluated last, and not computed again. batches: calls for many. clipped, not_numbers:
    points that lay out of bounds and were moved in, and points that were no numbers. improvements:
    of feasible points, for one goal alone. front: with several goals, unbeaten points and values.
    """

    values: int = 0
    gradients: int = 0
    repeated: int = 0
    batches: int = 0
    clipped: int = 0
    not_numbers: int = 0
    improvements: list[Improvement] = field(default_factory=list)
    best_x: np.ndarray | None = None
    front: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)
    process: int = field(default_factory=os.getpid, repr=False)
    """The process that it counts in."""

    @property
    def evaluations(self) -> int:
        """Evaluations that a budget counts: values and gradients."""
        return self.values + self.gradients

    @property
    def seconds(self) -> float:
        """Since the first evaluation, or since the objective was made."""
        return time.perf_counter() - self.began

    @property
    def best(self) -> float:
        """The least feasible value; infinite where there is none. Of a noisy instance it is the
        luckiest draw, as a rule far below what `Instance.value(best_x)` says, the mean of 256."""
        return self.improvements[-1].value if self.improvements else np.inf

    def count(self, name: str, by: int = 1) -> None:
        """Add to a counter."""
        if os.getpid() != self.process:
            raise RuntimeError(
                "an objective of another process, whose record would miss this evaluation; "
                "accepted: batches (`batch`, `penalised_batch`), or an objective of each process"
            )
        setattr(self, name, getattr(self, name) + by)

    def note(self, x: np.ndarray, values: np.ndarray, feasible: bool) -> None:
        """Keep the point that was counted last, if it is better."""
        if not feasible or not np.all(np.isfinite(values)):
            return
        if len(values) > 1:
            if not any(np.all(other <= values) for _, other in self.front):
                kept = [one for one in self.front if not np.all(values <= one[1])]
                self.front = [*kept, (read_only(x), read_only(values))]
        elif values[0] < self.best:
            self.improvements.append(Improvement(self.evaluations, self.seconds, float(values[0])))
            self.best_x = read_only(x)

    def note_batch(self, X: Any, values: Any, feasible: Any) -> None:
        """Keep what is better of a batch that was counted last."""
        counted = self.values
        better = feasible & np.isfinite(values).all(-1)
        if values.shape[1] == 1:
            least = np.minimum.accumulate(np.where(better, values[:, 0], np.inf))
            better &= values[:, 0] < np.minimum(self.best, np.append(np.inf, least[:-1]))
        for i in np.flatnonzero(better):
            self.values = counted - len(X) + int(i) + 1
            self.note(X[i], values[i], True)
        self.values = counted


class _Last(NamedTuple):
    """The last evaluated point: values [k], margins [m], draw, and if its value was asked for."""

    x: np.ndarray
    values: np.ndarray
    margins: np.ndarray
    draw: int
    asked: bool


@dataclass(frozen=True, eq=False)
class Objective:
    """minimise values(x) subject to low <= x <= high and constraints(x) >= 0, in NumPy's float64.

    Made by `Instance.objective`. The vector holds free numbers alone [n]; `expand` gives the
    problem's own. With k goals a point has values [k]; where k is 1, a number.

    budget: evaluations, values and gradients counted alike; seconds: from the first on. Who asks
    for more gets BudgetSpent. Points out of bounds are moved to the nearest inside, and counted; so
    are points that are no numbers, whose value is infinite. seed: of the draws, where the instance
    is noisy: every evaluation is a draw of its own.

    Every value asked for counts, as in COCO, also where it is that of the point looked at last and
    not computed again (`Record.repeated`); of a noisy instance it is drawn anew. Constraints at
    that point cost nothing. Slopes are those of the draw that its value had. A copy in another
    process refuses to evaluate.
    """

    problems: tuple[Problem[Any], ...]
    budget: int | None = None
    seconds: float | None = None
    seed: int = 0
    noisy: bool = False
    record: Record = field(default_factory=Record)

    def __post_init__(self):
        require_kind("problems", self.problems, tuple, "a tuple of problems, one a goal")
        for one in self.problems or [None]:
            require_kind("problems", one, Problem, "a tuple of problems, one a goal")
        if self.budget is not None:
            require_integer("budget", self.budget, high=2**53)
        if self.seconds is not None:
            accepted = "None, or a time > 0 [s]"
            require_scalar("seconds", self.seconds, low=0.0, strict=True, accepted=accepted)
        require_integer("seed", self.seed, low=0, high=2**31 - 1)

    def __getstate__(self) -> dict[str, Any]:
        return given_state(self)

    @cached_property
    def free(self) -> tuple[FreeProblem, ...]:
        return tuple(one.free for one in self.problems)

    @property
    def n(self) -> int:
        """Number of variables."""
        return self.free[0].n

    @property
    def k(self) -> int:
        """Number of goals."""
        return len(self.problems)

    @cached_property
    def m(self) -> int:
        """Number of constraints."""
        return len(self.free[0].constraints(self.middle))

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Least and greatest numbers, low < high."""
        return self.free[0].bounds

    @property
    def middle(self) -> Float[np.ndarray, "n"]:
        """The middle of the bounds: where a search may begin."""
        low, high = self.bounds
        return (low + high) / 2

    def from_unit(self, u: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """The numbers of a point in a box of sides 1."""
        low, high = self.bounds
        return low + (high - low) * _numbers(u)

    def to_unit(self, x: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """A point in a box of sides 1."""
        low, high = self.bounds
        return (_numbers(x) - low) / (high - low)

    @property
    def has_slopes(self) -> bool:
        """True if `gradient` and `jacobian` can be asked for."""
        return all(Structure.SMOOTH in one.structure for one in self.problems)

    def expand(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "whole"]:
        """The problem's whole point, with the given numbers at their values."""
        return self.free[0].expand(x)

    def __call__(self, x: Float[np.ndarray, "n"]) -> Any:
        """The value, or values [k]; infinite where there is none, never NaN."""
        values = self._look(x, asked=True).values
        return float(values[0]) if self.k == 1 else values.copy()

    def batch(self, X: Float[np.ndarray, "B n"]) -> Any:
        """Values of a batch: [B], or [B, k]."""
        return self.batch_with_constraints(X)[0]

    def batch_with_constraints(self, X: Float[np.ndarray, "B n"]) -> tuple[Any, np.ndarray]:
        """Values of a batch, [B] or [B, k], and its constraints [B, m]."""
        points, sound = self._inside(np.atleast_2d(_numbers(X)))
        left = self._left(asked := len(points))
        points, sound = points[:left], np.flatnonzero(sound[:left])
        values, margins = np.full((left, self.k), np.inf), np.full((left, self.m), -np.inf)
        self.record.count("batches")
        if len(sound):
            values[sound], margins[sound] = self._all(points[sound], sound)
        self.record.count("values", left)
        self.record.note_batch(points, values, self.free[0].meets(points, margins))
        if left < asked:
            raise self._spent()
        return (values[:, 0] if self.k == 1 else values), margins

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """The first goal's slope; NotImplementedError where the instance has none."""
        x, sound = self._point(x)
        draw, seen = self._draw(), self._seen_at(x)
        self._left(1)
        self.record.count("gradients")
        if not sound:
            return np.zeros(self.n)
        return self._drawn(self.free[0], draw if seen is None else seen.draw).gradient(x)

    def value_and_grad(self, x: Float[np.ndarray, "n"]) -> tuple[float, Float[np.ndarray, "n"]]:
        """Both, for one goal; counted as two evaluations."""
        return self(x), self.gradient(x)

    def constraints(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m"]:
        """Constraint margins, satisfied where >= 0, scaled to about 1."""
        return self._look(x).margins.copy()

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """Slopes of `constraints`; not counted."""
        x, sound = self._point(x)
        return self.free[0].jacobian(x) if sound else np.zeros((self.m, self.n))

    def violation(self, x: Float[np.ndarray, "n"]) -> float:
        """Sum of a point's constraint violations; 0 where it is feasible."""
        return float(shortfall(self.constraints(x)))

    def penalised(self, x: Float[np.ndarray, "n"]) -> float:
        """The first goal's value plus PENALTY times scaled violations beyond those let pass, for
        optimisers that take no constraints. A feasible point's value is its own; where there is
        none, PENALTY stands for it, so that violations still tell the way."""
        seen = self._look(x, asked=True)
        return float(penalised_values(seen.values[0], seen.margins))

    def penalised_batch(self, X: Float[np.ndarray, "B n"]) -> Float[np.ndarray, "B"]:
        """`penalised` of each row of X."""
        values, margins = self.batch_with_constraints(X)
        return penalised_values(values if self.k == 1 else values[:, 0], margins)

    def minimise(self, optimiser: Callable[[Objective], object]) -> Record:
        """Run optimiser(self) until it ends or the budget is spent; what was counted and found."""
        with suppress(BudgetSpent):
            optimiser(self)
        return self.record

    def _point(self, x: object) -> tuple[np.ndarray, np.ndarray]:
        """One point, inside, and if it is numbers."""
        return self._inside(_numbers(x).reshape(-1))

    def _inside(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points [..., n] moved into the bounds, a copy, and a mask of those that are numbers."""
        if x.shape[-1] != self.n:
            raise ValueError(f"x has shape {x.shape[-1:]}; accepted: ({self.n},)")
        moved = np.minimum(np.maximum(x, self.bounds[0]), self.bounds[1])
        same = moved == x
        if same.all():
            return moved, np.ones(x.shape[:-1], bool)
        sound = np.asarray(np.isfinite(x).all(-1))
        self.record.count("not_numbers", int(np.sum(~sound)))
        self.record.count("clipped", int(np.sum(sound & ~same.all(-1))))
        return moved, sound

    def _seen_at(self, x: np.ndarray) -> _Last | None:
        """Evaluation of the last point, if that is this one."""
        seen = self.__dict__.get("_seen")
        if seen is None or not ((seen.x == x).all() or np.array_equal(seen.x, x, equal_nan=True)):
            return None
        return seen

    def _look(self, x: object, asked: bool = False) -> _Last:
        """Evaluation of a point, or that of the last, but for a value of a noisy instance; infinite
        where x is none. asked: for its value."""
        x, sound = self._point(x)
        seen = None if asked and self.noisy else self._seen_at(x)
        if seen is not None:
            if asked and seen.asked:
                self._left(1)
                self.record.count("values")
                self.record.count("repeated")
            object.__setattr__(self, "_seen", seen._replace(asked=asked or seen.asked))
            return seen
        draw = self._draw()
        self._left(1)
        self.record.count("values")
        if not sound:
            lost = _Last(x, np.full(self.k, np.inf), np.full(self.m, -np.inf), draw, asked)
            object.__setattr__(self, "_seen", lost)
            return lost
        first, *others = (self._drawn(one, draw) for one in self.free)
        value, margins = first.value_and_margins(x)
        values = np.array([value, *(one.objective(x) for one in others)])
        seen = _Last(x, values, margins, draw, asked)
        object.__setattr__(self, "_seen", seen)
        self.record.note(x, values, self.free[0].meets(x, margins))
        return seen

    def _all(self, X: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values [B, k] and margins [B, m] of points inside."""
        first, *others = (one.problem for one in self.free)
        whole = self.expand(X)
        if self.noisy and isinstance(first, FunctionProblem):
            value, margins = first.evaluate_all(whole, (self._draw() + places) % 2**32)
        else:
            value, margins = first.evaluate_all(whole)
        return np.stack([value, *(one.objectives(whole) for one in others)], axis=1), margins

    def _draw(self) -> int:
        """The number of the next evaluation's draw."""
        return (self.seed * A_DRAW + self.record.evaluations) % 2**32

    def _drawn(self, free: FreeProblem, draw: int) -> FreeProblem:
        if not self.noisy or not isinstance(free.problem, FunctionProblem):
            return free
        return free.problem.drawn(draw).free

    def _left(self, wanted: int) -> int:
        """Number of these evaluations that the budget allows; BudgetSpent for none."""
        record = self.record
        if record.evaluations == 0:
            record.began = time.perf_counter()
        late = self.seconds is not None and record.seconds > self.seconds
        left = wanted if self.budget is None else self.budget - record.evaluations
        if wanted and (late or left <= 0):
            raise self._spent()
        return min(wanted, left)

    def _spent(self) -> BudgetSpent:
        record = self.record
        return BudgetSpent(f"{record.evaluations} evaluations in {record.seconds:.3g} s")


def penalised_values(values: Any, margins: Float[np.ndarray, "... m"]) -> np.ndarray:
    """See `Objective.penalised`."""
    missed, limited = shortfall(margins + FEASIBLE), margins.shape[-1] > 0
    return np.where(np.isinf(values) & limited, PENALTY, values) + PENALTY * missed


def _numbers(x: Any) -> np.ndarray:
    """As float64, finite or not; ValueError for no real numbers, as complex and masked arrays."""
    if type(x) is np.ndarray and (x.dtype == float or x.size == 0):
        return x
    return as_real("x", x, "real numbers").astype(float)
