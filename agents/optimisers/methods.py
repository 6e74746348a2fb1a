"""Optimisers by name: functions of an objective and a seed, ended by the objective's budget.

Local searches start in the middle of the bounds with seed 0, at uniform random points else, and
restart until the budget ends. Optional libraries are imported when a method runs.
"""

import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pkgutil import resolve_name
from typing import TypeAlias

import numpy as np
from scipy.optimize import minimize

from stickslip.dynamics.checks import require_choice, require_kind, shown
from stickslip.dynamics.lazily import require
from stickslip.optim.instances import exports
from stickslip.optim.instances.instance import Instance
from stickslip.optim.instances.objective import Objective
from stickslip.optim.problem import solve

Optimiser: TypeAlias = Callable[[Objective, int], object]


@dataclass(frozen=True)
class Method:
    """An optimiser by name.

    function: minimises until it ends or the budget ends it. inside: it works on the problem itself:
    its time alone is comparable and its seeds do not differ. families: of instances, all if empty.
    convex: whether it takes convex instances only. most: free numbers at most.
    """

    name: str
    function: Optimiser
    inside: bool = False
    families: tuple[str, ...] = ()
    convex: bool = False
    most: int = 10**8

    def unsuited(self, instance: Instance) -> str:
        """Reason why the method does not suit an instance; "" where it does."""
        if len(instance.goals) > 1:
            return "takes one goal"
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
        size = float(np.mean(np.subtract(*objective.bounds[::-1])))
        options = options | {"rhobeg": exports.SIGMA * size}
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
        begins = objective.to_unit(start), given["sigma0"], given["options"]
        strategy = library.CMAEvolutionStrategy(*begins)
        while not strategy.stop():
            asked = strategy.ask()
            values = given["objective_function"](np.array(asked))
            strategy.tell(asked, np.asarray(values).tolist())


def _starts(objective: Objective, seed: int) -> Iterator[np.ndarray]:
    """With seed 0 first the bounds' middle, else uniform points, until one evaluates nothing."""
    rng, before = np.random.default_rng([seed, 7]), -1
    start = objective.middle if seed == 0 else objective.from_unit(rng.random(objective.n))
    while objective.record.evaluations > before:
        before = objective.record.evaluations
        yield start
        start = objective.from_unit(rng.random(objective.n))


METHODS = {
    one.name: one
    for one in (
        Method("dp", partial(dynamic_programming, False), inside=True, families=("posture",)),
        Method("dp-scp", partial(dynamic_programming, True), inside=True, families=("posture",)),
        Method("conic", conic, inside=True, families=("gait", "split"), convex=True),
        Method("cma", cma),
        Method("slsqp", partial(scipy_local, "SLSQP", {"maxiter": 1000})),
        Method("trust-constr", partial(scipy_local, "trust-constr", {"maxiter": 1000})),
        Method("cobyla", partial(scipy_local, "COBYLA", {"maxiter": 10**6}), most=40),
        Method("random", random_search),
    )
}
"""The optimisers that races know by name (docs/suite.md)."""


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
        sys.path[:] = dict.fromkeys([*sys.path, os.getcwd()])  # which workers take over
        try:
            one = resolve_name(one)
        except (ImportError, AttributeError, ValueError) as error:
            raise ValueError(f"method {one}: {error}; accepted: MODULE:FUNCTION") from error
    if name in METHODS or not name.strip() or len(name) > 80:
        accepted = "a name of your own, of up to 80 characters, that none of METHODS has"
        raise ValueError(f"method {shown(name)}; accepted: {accepted}")
    if not callable(one):
        raise ValueError(f"method {name}: {shown(one)}; accepted: a function of objective and seed")
    return Method(name, one)
