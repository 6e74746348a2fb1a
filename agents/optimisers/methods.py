"""Optimisers by name: functions of an objective and a seed, ended by the objective's budget.

Local searches start in the middle of the bounds with seed 0, at uniform random points else, and
restart until the budget ends. Optional libraries are imported when a method runs.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from scipy.optimize import minimize

from stickslip.dynamics.checks import require_choice, require_kind, shown
from stickslip.dynamics.lazily import require
from stickslip.optim.instances import exports
from stickslip.optim.problem import solve

if TYPE_CHECKING:
    from stickslip.optim.instances.instance import Instance
    from stickslip.optim.instances.objective import Objective

Optimiser: TypeAlias = "Callable[[Objective, int], object]"
MANY = 10**8
POSTURES: dict[str, Any] = {"families": ("posture",)}


@dataclass(frozen=True)
class Method:
    """An optimiser by name.

    about: one line. function: minimises until it ends or the budget ends it. constraints: "native";
    "penalty": it minimises `Objective.penalised`; "structure": it works on the problem itself, so
    that only its time is comparable (`inside`) and its seeds do not differ. batch: points evaluated
    at once. goals: fewest and most. families: of instances, all if empty. convex: whether it takes
    convex instances only. most: free numbers at most.
    """

    name: str
    about: str
    function: Optimiser
    library: str = "yours"
    constraints: Literal["native", "penalty", "structure"] = "penalty"
    batch: int = 1
    goals: tuple[int, int] = (1, 1)
    families: tuple[str, ...] = ()
    convex: bool = False
    most: int = MANY

    @property
    def inside(self) -> bool:
        """True if it works on the problem itself, so that its evaluations are not comparable."""
        return self.constraints == "structure"

    def unsuited(self, instance: Instance) -> str:
        """Reason why the method does not suit an instance; "" where it does."""
        goals = len(instance.goals)
        if not self.goals[0] <= goals <= self.goals[1]:
            return f"takes {self.goals[0]} to {self.goals[1]} goals, not {goals}"
        if self.families and instance.family not in self.families:
            return f"takes {', '.join(self.families)}, not {instance.family}"
        if self.convex and not instance.flags.convex:
            return "takes convex problems only"
        return f"takes {self.most} numbers at most" if instance.n > self.most else ""


def random_search(objective: Objective, seed: int) -> None:
    """Evaluate uniform points, 64 at once."""
    rng = np.random.default_rng(seed)
    while True:
        objective.batch_with_constraints(objective.from_unit(rng.random((64, objective.n))))


def dynamic_programming(polish: bool, objective: Objective, seed: int) -> None:
    """Evaluate the grid's best trajectory, or where convex programs lead from there."""
    found = solve(objective.problems[0], "dp", polish=polish)
    if found.x is None:
        raise RuntimeError(found.message or found.status.value)
    objective(objective.free[0].reduce(found.x))


def conic(objective: Objective, seed: int) -> None:
    """Evaluate the solution of the convex program."""
    program, found = objective.problems[0].in_cvxpy()
    program.solve(solver="CLARABEL")
    objective(np.clip(objective.free[0].reduce(found()), *objective.bounds))


def scipy_local(method: str, options: dict[str, float], objective: Objective, seed: int) -> None:
    """Restart a method of scipy.optimize.minimize; COBYLA begins with a fifth of the bounds."""
    if method == "COBYLA":
        options = options | {
            "rhobeg": exports.SIGMA * float(np.mean(np.subtract(*objective.bounds[::-1])))
        }
    for start in _starts(objective, seed):
        given = exports.as_scipy(objective, start)
        if method == "COBYLA":
            given.pop("jac", None)
            given.get("constraints", {}).pop("jac", None)
        with warnings.catch_warnings(action="ignore"):  # about intermediate points
            minimize(**given, method=method, options=options)


def cma(objective: Objective, seed: int) -> None:
    """Restart the package cma on the penalised objective."""
    library = require("cma", "this method", "optimisers")
    for number, start in enumerate(_starts(objective, seed)):
        given = exports.as_cma(objective, seed=10_000 * seed + number)
        strategy = library.CMAEvolutionStrategy(
            objective.to_unit(start), given["sigma0"], given["options"]
        )
        while not strategy.stop():
            asked = strategy.ask()
            values = given["objective_function"](np.array(asked))
            strategy.tell(asked, np.asarray(values).tolist())


def nsga2(objective: Objective, seed: int) -> None:
    """Run pymoo's NSGA-II."""
    algorithm = require("pymoo.algorithms.moo.nsga2", "this method", "optimisers").NSGA2
    run = require("pymoo.optimize", "this method", "optimisers").minimize
    run(exports.as_pymoo(objective), algorithm(pop_size=40), ("n_gen", MANY), seed=seed + 1)


def _starts(objective: Objective, seed: int) -> Iterator[np.ndarray]:
    """The middle of the bounds first with seed 0, uniformly random points else, until a search
    evaluates nothing."""
    rng, before = np.random.default_rng([seed, 7]), -1
    start = objective.middle if seed == 0 else objective.from_unit(rng.random(objective.n))
    while objective.record.evaluations > before:
        before = objective.record.evaluations
        yield start
        start = objective.from_unit(rng.random(objective.n))


METHODS = {
    one.name: one
    for one in (
        Method("dp", "dynamic programming over a grid of leg angles",
               partial(dynamic_programming, False), "stickslip.optim", "structure", **POSTURES),
        Method("dp-scp", "the same, polished by sequential convex programs",
               partial(dynamic_programming, True), "stickslip.optim", "structure", **POSTURES),
        Method("conic", "cvxpy with Clarabel", conic,
               "cvxpy", "structure", families=("gait", "split"), convex=True),
        Method("cma", "covariance matrix adaptation, sigma 0.2 of the box, with restarts", cma,
               "cma", "penalty", batch=16),
        Method("slsqp", "SLSQP with restarts; differences where there are no gradients",
               partial(scipy_local, "SLSQP", {"maxiter": 1000}), "scipy", "native"),
        Method("trust-constr", "an interior point with trust regions, with restarts",
               partial(scipy_local, "trust-constr", {"maxiter": 1000}), "scipy", "native"),
        Method("cobyla", "linear models without gradients, with restarts",
               partial(scipy_local, "COBYLA", {"maxiter": 10**6}), "scipy", "native", most=40),
        Method("pymoo-nsga2", "NSGA-II, 40 points", nsga2,
               "pymoo", "native", batch=64, goals=(2, 9)),
        Method("random", "uniform random points, 64 at once", random_search,
               "numpy", "native", batch=64, goals=(1, 9)),
    )
}  # fmt: skip


def methods_of(given: Iterable[str] | Mapping[str, Optimiser | str]) -> list[Method]:
    """Methods by names of METHODS or as MODULE:FUNCTION, or functions under names of one's own.

    ValueError for an unknown name, with the nearest, or for what cannot be called.
    """
    pairs = given if isinstance(given, Mapping) else {name: name for name in given}
    return [_method(name, one) for name, one in pairs.items()]


def _method(name: str, one: Optimiser | str) -> Method:
    require_kind("method", name, str, "a name")
    if isinstance(one, str) and ":" not in one:
        require_choice("method", one, METHODS, also="MODULE:FUNCTION")
        return METHODS[one]
    if isinstance(one, str):
        if "" not in sys.path:  # the working directory, of the workers, too
            sys.path.append("")
        try:
            one = resolve_name(one)
        except (ImportError, AttributeError, ValueError) as error:
            raise ValueError(f"method {one}: {error}; accepted: MODULE:FUNCTION") from error
    if name in METHODS or not name.strip() or len(name) > 80:
        raise ValueError(
            f"method {shown(name)}; accepted: a name of your own, of up to 80 characters, that "
            "none of METHODS has"
        )
    if not callable(one):
        raise ValueError(f"method {name}: {shown(one)}; accepted: a function of objective and seed")
    return Method(name, "a function of the user's", one)
