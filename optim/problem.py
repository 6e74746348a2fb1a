"""Optimisation problem with plain arrays in and out, results, one door to all methods: `solve`.

    minimise objective(x)   subject to   low <= x <= high,   constraints(x) >= 0

Methods ask for what they need by Structure; scipy, pymoo, cma, nevergrad take a problem as it is.
"""

from __future__ import annotations

import inspect
import time
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, Self, TypeVar, cast

import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.pytrees import Lists, Number, given_state, read_only, require_one
from stickslip.optim import GENERAL_METHODS

if TYPE_CHECKING:
    import cvxpy as cp
    from jaxtyping import Bool, Float, Real

    Vector = Real[Number, "n"] | Lists
    Batch = Real[Number, "B n"] | Lists

R = TypeVar("R", bound="Result")

FEASIBLE = 1e-6
"""Tolerated violation of a scaled constraint, or of a bound."""
COUNT = 10**12
"""The greatest number of iterations, edges and the like that may be asked for."""


def shortfall(margins: Float[np.ndarray, "... m"]) -> Float[np.ndarray, "..."]:
    """Sum of the violated scaled margins of each point; 0 for feasible points."""
    return np.maximum(-margins, 0).sum(-1)


class OptimStatus(Enum):
    """Outcome of a method; each value describes itself."""

    OPTIMAL = "proved optimal to the method's tolerance"
    FEASIBLE = "meets every constraint; not proved optimal"
    LIMIT = "stopped at a limit of iterations or time; the best point so far"
    INACCURATE = "the numbers do not agree to the accuracy that was asked for"
    VIOLATED = "a point that breaks a constraint: see residuals"
    INFEASIBLE = "proved: no point meets every constraint"
    FAILED = "no usable answer"

    @property
    def solved(self) -> bool:
        """True if the point meets every constraint and the method ended as it should."""
        return self in (OptimStatus.OPTIMAL, OptimStatus.FEASIBLE)


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of a point.

    value: the objective's, infinite where there is none, never NaN. margins: `constraints` there
    [m], scaled to about 1. feasible: within FEASIBLE. residuals: by how much each kind of
    constraint is missed at worst, in its own unit, 0 where it is met.
    """

    value: float
    margins: Float[np.ndarray, "m"]
    feasible: bool
    residuals: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    """The outcome of `solve`; a problem's `result_kind` may say more.

    x: the decision vector [n], None where there is none. value: the problem's own objective at x,
    evaluated anew; infinite without x. lower_bound: no feasible point of the problem has a lower
    value; at most `value`; None: nothing is proved. feasible, residuals: of x, by the problem
    (Problem.residuals). evaluations: their number, of what the method's docstring says. seconds:
    all of it, compilation too. message: for a person. details: the method's own findings.
    """

    method: str
    status: OptimStatus
    x: Float[np.ndarray, "n"] | None
    value: float
    lower_bound: float | None = None
    feasible: bool = False
    residuals: Mapping[str, float] = field(default_factory=dict)
    evaluations: int = 0
    seconds: float = 0.0
    message: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        if self.x is not None:
            object.__setattr__(self, "x", read_only(self.x))

    @property
    def gap(self) -> float:
        """Gap between value and lower bound; infinite if nothing is proved."""
        return np.inf if self.lower_bound is None else self.value - self.lower_bound

    @property
    def status_in_words(self) -> str:
        return f"{self.status.name}: {self.status.value}"

    @classmethod
    def without_point(
        cls, *, method: str, status: OptimStatus, began: float, message: str, **others: Any
    ) -> Self:
        """The result of a method that found no point."""
        seconds = time.perf_counter() - began
        return cls(method, status, None, np.inf, seconds=seconds, message=message, **others)


class Structure(Enum):
    """Structure of a problem that a method may require; each value describes itself."""

    SMOOTH = "objective and constraints have slopes nearly everywhere: gradient, jacobian"
    CONVEX = "what no direction improves is the best: objective and feasible set are convex"


class Method(NamedTuple):
    """A method by name: what it is in a line, where its function is, and what it asks for."""

    what: str
    function: str
    """module:function, imported when the method is asked for."""
    needs: frozenset[Structure] = frozenset()


class Problem(ABC, Generic[R]):
    """A problem in float64 [n], whose methods return an R.

    A subclass gives n, bounds and evaluate; with slopes also gradient, jacobian and SMOOTH. What it
    can do for whole batches at once it overrides.
    """

    methods: ClassVar[Mapping[str, Method]] = {}
    """Methods of its own, beside or in place of those for all problems."""
    result_kind: ClassVar[type[Result]] = Result
    default_method: ClassVar[str | None] = None
    """None: the first that it has."""

    def __getstate__(self) -> dict[str, Any]:
        """Constructor's arguments: a copy, or another process, computes the rest."""
        return given_state(self)

    @property
    def structure(self) -> frozenset[Structure]:
        """Structures that methods may use."""
        return frozenset()

    @property
    @abstractmethod
    def n(self) -> int:
        """Length of the decision vector."""

    @property
    @abstractmethod
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Least and greatest numbers, not to be written to; the same where one is given."""

    @abstractmethod
    def evaluate(self, x: Vector) -> Evaluation:
        """Everything about a point, computed once."""

    @cached_property
    def free(self) -> FreeProblem:
        """The same without the numbers that are given, for optimisers that refuse equal bounds."""
        return FreeProblem(self)

    def objective(self, x: Vector) -> float:
        """The value to minimise; infinite where there is none, never NaN."""
        return self.value_and_margins(x)[0]

    def constraints(self, x: Vector) -> Float[np.ndarray, "m"]:
        """Everything but the bounds, scaled to about 1, satisfied where >= 0."""
        return self.value_and_margins(x)[1]

    def objectives(self, X: Batch) -> Float[np.ndarray, "B"]:
        """`objective` of each row of X."""
        return self.evaluate_all(X)[0]

    def value_and_margins(self, x: Vector) -> tuple[float, Float[np.ndarray, "m"]]:
        """The objective and `constraints`, computed once: what optimisers ask for all the time."""
        at = self.evaluate(x)
        return at.value, at.margins

    def evaluate_all(self, X: Batch) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B m"]]:
        """Values and margins of a batch, each point evaluated once."""
        found = [self.evaluate(x) for x in self.batch(X)]
        return np.array([at.value for at in found]), np.array([at.margins for at in found])

    def gradient(self, x: Vector) -> Float[np.ndarray, "n"]:
        """The objective's slope; a problem without Structure.SMOOTH has none."""
        raise NotImplementedError(f"{type(self).__name__} has no slopes")

    def jacobian(self, x: Vector) -> Float[np.ndarray, "m n"]:
        """Slopes of `constraints`; a problem without Structure.SMOOTH has none."""
        raise NotImplementedError(f"{type(self).__name__} has no slopes")

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "n"]]]:
        """A cvxpy problem, to be solved by any of its solvers, and what gives the decision vector
        then; NotImplementedError for a problem that is not convex."""
        raise NotImplementedError(f"{type(self).__name__} is not written in cvxpy")

    def sample(self, X: Batch) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B"]]:
        """Values of a batch, and the sum of each point's violated scaled margins."""
        values, margins = self.evaluate_all(X)
        return values, shortfall(margins)

    def residuals(self, x: Vector) -> Mapping[str, float]:
        """Largest violation of each kind of constraint: see Evaluation."""
        return self.evaluate(x).residuals

    def is_feasible(self, x: Vector, tolerance: float = FEASIBLE) -> bool:
        """True if no scaled constraint and no bound is violated by more than `tolerance`."""
        point = self.point(x)
        return bool(self.meets(point, self.constraints(point), tolerance))

    def meets(self, x: np.ndarray, margins: np.ndarray, tolerance: float = FEASIBLE) -> Any:
        """True if points with these margins violate none of them and no bound by more."""
        low, high = self.bounds
        within = (x >= low - tolerance) & (x <= high + tolerance)
        return within.all(-1) & (margins >= -tolerance).all(-1)

    def shortcomings(self, x: Vector) -> str:
        """Text of the constraints that a point violates and by how much; empty for none."""
        if self.is_feasible(x):
            return ""
        violated = ((name, by) for name, by in self.residuals(x).items() if by > 0)
        return "; misses " + ", ".join(f"{name} by {by:.4g}" for name, by in violated)

    def batch(self, X: Any) -> Float[np.ndarray, "B n"]:
        """Decision vectors, or none; ValueError for a wrong length or what is not finite."""
        none = isinstance(X, np.ndarray) and X.size == 0 and X.dtype == float
        array = X if none else as_floats("x", X, f"{self.n} finite numbers")
        if array.ndim != 2 or array.shape[1] != self.n:
            raise ValueError(f"x has shape {array.shape[1:]}; accepted: ({self.n},)")
        return array

    def filled(self, X: Any, *others: np.ndarray, each: float) -> tuple[int, list[np.ndarray]]:
        """The number of rows of a batch, and it with other arrays [B], the last row repeated up to
        a power of two, so that few sizes are compiled. each: bytes that a point takes."""
        count = len(X) if np.ndim(X) else 0
        size = count and 1 << (count - 1).bit_length()
        checks.require_memory(f"X of {count} points", "members of a batch", size, each)
        return count, [padded(of, size) for of in (self.batch(X), *others)]

    def point(self, x: Vector) -> Float[np.ndarray, "n"]:
        """One decision vector, checked alike."""
        return self.batch(x[None] if isinstance(x, np.ndarray) else [x])[0]

    def start_point(self, start: Any, progress: bool) -> tuple[Float[np.ndarray, "n"], str]:
        """Start of a local method, within the bounds, and a note for its message.

        start: a decision vector, else ValueError; None: the middle of the bounds.
        """
        low, high = self.bounds
        if start is None:
            return (low + high) / 2, ""
        accepted = f"None, or {self.n} finite numbers"
        x = as_floats("start", start, accepted)
        if x.shape != (self.n,):
            raise ValueError(f"start has shape {x.shape}; accepted: {accepted}")
        return np.clip(x, low, high), ""

    def begin(
        self, method: str, start: Any, progress: bool, began: float
    ) -> tuple[Float[np.ndarray, "n"], float, str] | R:
        """Where a local method begins, its value, and a note on it: see `start_point`. Or the
        result, where there is no value at it, or no choice. ValueError without finite bounds."""
        if not np.all(np.isfinite(self.bounds)):
            raise ValueError("bounds are not finite; accepted: finite bounds, to search in")
        x, note = self.start_point(start, progress)
        value = self.objective(x)
        if self.free.n == 0:
            status, why = OptimStatus.FEASIBLE, "every number is given"
        elif not np.isfinite(value):
            status, why = OptimStatus.FAILED, "where it begins there is no value"
        else:
            return x, value, note
        message = note + why + self.shortcomings(x)
        common = {"method": method, "began": began, "evaluations": 1}
        return self.result(x, status=status, message=message, **common)

    def result(
        self, x: Vector, *, method: str, status: OptimStatus, began: float, **others: Any
    ) -> R:
        """A method's result at a point: value, residuals and feasibility are the problem's own.

        A point that breaks a constraint is VIOLATED however the method ended, which its message
        says; FAILED and INFEASIBLE stay.
        began: time.perf_counter() when the method began. others: the remaining fields.
        """
        x = np.array(x, dtype=float).reshape(-1)
        at = self.evaluate(x)
        stays = at.feasible or status in (OptimStatus.INFEASIBLE, OptimStatus.FAILED)
        found = self.result_kind(
            method=method,
            status=status if stays else OptimStatus.VIOLATED,
            x=x,
            value=at.value,
            feasible=at.feasible,
            residuals=at.residuals,
            seconds=time.perf_counter() - began,
            **others,
        )
        return cast("R", found)


@dataclass(frozen=True)
class FreeProblem(Problem[Result]):
    """The same problem without numbers whose bounds are equal, as given ends are (n may be 0).

    Objective and constraints, in value and number, are the problem's at `expand(x)`.
    """

    problem: Problem[Any]

    @property
    def structure(self) -> frozenset[Structure]:
        """Slopes and convexity stay; what is known of the rest is of the whole vector."""
        return self.problem.structure & {Structure.SMOOTH, Structure.CONVEX}

    @cached_property
    def which(self) -> Bool[np.ndarray, "whole"]:
        """Mask of the problem's free numbers."""
        low, high = self.problem.bounds
        return read_only(low < high)

    @property
    def n(self) -> int:
        return len(self.bounds[0])

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:  # type: ignore[override]
        low, high = self.problem.bounds
        return read_only(low[self.which]), read_only(high[self.which])

    def expand(self, x: Real[Number, "... n"] | Lists) -> Float[np.ndarray, "... whole"]:
        """The problem's decision vector, or a batch; ValueError for a wrong length."""
        free = np.asarray(x, dtype=float) if self.n == 0 else as_floats("x", x, "the free numbers")
        free = _of_length(free, self.n)
        given = self.problem.bounds[0]
        whole = np.empty((*free.shape[:-1], len(given)))
        whole[:] = given
        whole[..., self.which] = free
        return whole

    def reduce(self, x: Float[np.ndarray, "... whole"]) -> Float[np.ndarray, "... n"]:
        """The free numbers of a decision vector, or of a batch; ValueError for a wrong length."""
        return _of_length(as_floats("x", x, "all numbers"), self.problem.n)[..., self.which]

    def evaluate(self, x: Vector) -> Evaluation:
        """See Problem, as all below; constraints of given numbers alone are constant."""
        return self.problem.evaluate(self.expand(x))

    def value_and_margins(self, x: Vector) -> tuple[float, Float[np.ndarray, "m"]]:
        return self.problem.value_and_margins(self.expand(x))

    def evaluate_all(self, X: Batch) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B m"]]:
        return self.problem.evaluate_all(self.expand(X))

    def gradient(self, x: Vector) -> Float[np.ndarray, "n"]:
        return self.problem.gradient(self.expand(x))[self.which]

    def jacobian(self, x: Vector) -> Float[np.ndarray, "m n"]:
        return self.problem.jacobian(self.expand(x))[:, self.which]


def padded(rows: np.ndarray, size: int, begin: int = 0) -> np.ndarray:
    """So many of them from `begin` on, filled up with the last."""
    return rows[np.minimum(np.arange(begin, begin + size), len(rows) - 1)]


def _of_length(x: np.ndarray, n: int) -> np.ndarray:
    """The numbers, or ValueError unless the last axis has so many."""
    if x.ndim == 0 or x.shape[-1] != n:
        raise ValueError(f"x has shape {x.shape}; accepted: (..., {n})")
    return x


GENERAL = {
    name: Method(GENERAL_METHODS[name], f"stickslip.optim.methods:solve_{name}", frozenset(needs))
    for name, needs in (("gradient", {Structure.SMOOTH}), ("cma", set[Structure]()))
}
"""The methods for every problem that has what they need."""


def methods_of(problem: Problem[Any]) -> dict[str, Method]:
    """The methods that take a problem, by name: its own, and those of GENERAL that it fits."""
    fitting = {name: one for name, one in GENERAL.items() if one.needs <= problem.structure}
    return {**problem.methods, **fitting, **problem.methods}


def solve(
    problem: Problem[R],
    method: str | None = None,
    *,
    polish: bool = True,
    progress: bool = False,
    **options: Any,
) -> R:
    """Solve a problem by one of `methods_of` it; None: its default ("dp" of a posture problem).

    polish: let a local method follow where a method can (scp after dp); False: the method's own
    point, of which alone is proved what it proves. progress: told on standard error. options: the
    method's own, see its function's docstring; ValueError lists them where one is unknown.
    """
    checks.require_kind("problem", problem, Problem, "a Problem, such as a PostureProblem")
    known = methods_of(problem)
    if method is None:
        method = problem.default_method or next(iter(known))
    checks.require_choice("method", method, tuple(known))
    for name, value in (("polish", polish), ("progress", progress)):
        checks.require_kind(name, value, bool, "True or False")
    function = resolve_name(known[method].function)
    checks.require_known(options, options_of_method(known[method]), f"option of {method!r}")
    if "polish" in inspect.signature(function).parameters:
        options["polish"] = polish
    return cast("R", function(problem, progress=progress, **options))


def options_of_method(method: Method) -> tuple[str, ...]:
    """Names of the options that `solve` hands to a method: keyword-only ones of its function."""
    found = inspect.signature(resolve_name(method.function)).parameters.values()
    own = ("progress", "polish")
    return tuple(p.name for p in found if p.kind is p.KEYWORD_ONLY and p.name not in own)


def require_scalar(name: str, value: Any, **rule: Any) -> None:
    """`require_one` in double precision, whatever jax_enable_x64 says."""
    require_one(name, value, dtype=np.float64, **rule)


def as_floats(name: str, value: Any, accepted: str) -> np.ndarray:
    """Numbers in double precision, or ValueError for what is none, or not finite there."""
    usual = type(value) is np.ndarray and value.dtype == float and value.size > 0
    if usual and np.isfinite(value).all():  # what optimisers ask with, again and again
        return value
    checks.require_number(name, value, accepted=accepted, dtype=np.float64)
    return np.asarray(value, dtype=float)


STATUSES = {
    "optimal": OptimStatus.OPTIMAL,
    "optimal_inaccurate": OptimStatus.INACCURATE,
    "user_limit": OptimStatus.LIMIT,
    "infeasible": OptimStatus.INFEASIBLE,
}
"""Outcomes of cvxpy's statuses; all others are FAILED. Inaccurate proves nothing."""


class Ended(NamedTuple):
    """Outcome of a solver, with the solver's or cvxpy's message."""

    status: OptimStatus
    message: str

    @property
    def answered(self) -> bool:
        """True if there is a point to look at."""
        return self.status in (OptimStatus.OPTIMAL, OptimStatus.INACCURATE, OptimStatus.LIMIT)


def solve_quietly(problem: cp.Problem, *, bounded: bool = False, **settings: float) -> Ended:
    """Solve with Clarabel, and name the outcome; FAILED where the solver gave up.

    bounded: the objective has a floor, so that "infeasible or unbounded" means INFEASIBLE.
    settings: the solver's own. Each solve starts afresh: a solver that is kept scales other numbers
    as it scaled the first, and may fail. A warning of inaccuracy is left out: the status says it.
    """
    import cvxpy as cp

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Solution may be inaccurate")
        try:
            problem.solve(solver="CLARABEL", warm_start=False, **settings)
        except cp.SolverError as error:
            return Ended(OptimStatus.FAILED, f"CLARABEL: {error}")
    message = f"CLARABEL ended with status {problem.status}"
    if bounded and problem.status == "infeasible_or_unbounded":
        return Ended(OptimStatus.INFEASIBLE, message)
    return Ended(STATUSES.get(problem.status, OptimStatus.FAILED), message)
