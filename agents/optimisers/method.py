"""Methods by name: what each is, what it asks for, and how it deals with constraints."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Literal

from stickslip.dynamics.plain_checks import nearest, require_choice, require_kind, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from stickslip.optim.instances.instance import Instance
    from stickslip.optim.instances.objective import Objective
    from stickslip.records.table import Table

    Optimiser = Callable[[Objective, int], object]

HERE = "stickslip.agents.optimisers.methods"


@dataclass(frozen=True)
class Method:
    """An optimiser by name.

    what: it in a line. function: of an objective and a seed, minimising until it ends or the budget
    ends it; or where that is, as module:name. library: what brings it. constraints: "native": told
    of them; "penalty": of `Objective.penalised`; "structure": works on the problem itself, so that
    only its time is comparable (`inside`). slopes: whether it needs gradients. batch: points that
    it gives at once, 1 for single ones. seeded: whether seeds differ. goals: fewest and most that
    it takes. families: of instances, all if empty. convex: whether it takes no others. most: free
    numbers at most.
    """

    name: str
    what: str
    function: str | Optimiser
    library: str = "yours"
    constraints: Literal["native", "penalty", "structure"] = "penalty"
    slopes: bool = False
    batch: int = 1
    seeded: bool = True
    goals: tuple[int, int] = (1, 1)
    families: tuple[str, ...] = ()
    convex: bool = False
    most: int = 10**9

    @property
    def inside(self) -> bool:
        """Whether it looks into the problem, so that its evaluations say nothing."""
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
        if self.slopes and not instance.flags.slopes:
            return "needs gradients, which it has not"
        return f"takes {self.most} numbers at most" if instance.n > self.most else ""

    def run(self, objective: Objective, seed: int) -> object:
        """Minimise. BudgetSpent, or whatever the optimiser raises."""
        function = self.function
        if isinstance(function, str):
            module, name = function.split(":")
            function = getattr(import_module(module), name)
        return function(objective, seed)


METHODS = {
    one.name: one
    for one in (
        Method("dp", "dynamic programming over a grid of leg angles", f"{HERE}.own:dp",
               "stickslip.optim", "structure", seeded=False, families=("posture",)),
        Method("scp", "sequential convex programming, from where dp ends", f"{HERE}.own:scp",
               "stickslip.optim", "structure", seeded=False, families=("posture",)),
        Method("conic", "cvxpy with Clarabel", f"{HERE}.own:conic",
               "cvxpy", "structure", seeded=False, families=("gait", "split"), convex=True),
        Method("gradient", "SLSQP on the value in parts of its first size, with restarts",
               f"{HERE}.own:gradient", "stickslip.optim", "native", slopes=True),
        Method("cma", "covariance matrix adaptation, sigma 0.2 of the box, with restarts",
               f"{HERE}.own:cma", "stickslip.optim with cma", "penalty", batch=16),
        Method("slsqp", "SLSQP as it is, with restarts; differences where there are no gradients",
               f"{HERE}.local:slsqp", "scipy", "native"),
        Method("trust-constr", "an interior point with trust regions, with restarts",
               f"{HERE}.local:trust_constr", "scipy", "native", slopes=True),
        Method("cobyla", "linear models without gradients, with restarts",
               f"{HERE}.local:cobyla", "scipy", "native", most=40),
        Method("adam", "Adam on the penalised gradient, 0.02 of the box falling to 0",
               f"{HERE}.local:adam", "stickslip.agents", "penalty", slopes=True),
        Method("de", "differential evolution, 32 points", f"{HERE}.evolution:de",
               "scipy", "penalty", batch=32),
        Method("evosax-cma-es", "covariance matrix adaptation, 32 points",
               f"{HERE}.evolution:evosax_cma_es", "evosax", "penalty", batch=32),
        Method("evosax-snes", "separable natural evolution, 32 points",
               f"{HERE}.evolution:evosax_snes", "evosax", "penalty", batch=32),
        Method("pymoo-isres", "evolution with stochastic ranking, 64 offspring",
               f"{HERE}.evolution:pymoo_isres", "pymoo", "native", batch=64),
        Method("pymoo-nsga2", "NSGA-II, 40 points", f"{HERE}.evolution:pymoo_nsga2",
               "pymoo", "native", batch=64, goals=(2, 9)),
        Method("nevergrad-de", "two-point differential evolution, 30 points",
               f"{HERE}.evolution:nevergrad_de", "nevergrad", "penalty"),
        Method("optuna-tpe", "tree-structured Parzen estimators", f"{HERE}.evolution:optuna_tpe",
               "optuna", "penalty", goals=(1, 9), most=16),
        Method("random", "uniform random points, 64 at once", f"{HERE}.evolution:random_search",
               "stickslip.agents", "native", batch=64, goals=(1, 9)),
    )
}  # fmt: skip


def methods_table() -> Table:
    """A row for each method."""
    from stickslip.records.table import Column, Table

    rows = []
    for one in METHODS.values():
        takes = "several goals" if one.goals[0] > 1 else "one goal or several"
        rest = [takes] if one.goals != (1, 1) else []
        rest += [", ".join(one.families)] if one.families else []
        rest += ["convex"] if one.convex else []
        rest += [f"{one.most} numbers at most"] if one.most < 10**9 else []
        asks = "gradients" if one.slopes else (f"batches of {one.batch}" if one.batch > 1 else "")
        row = [f"`{one.name}`", one.library, one.what, asks, one.constraints, "; ".join(rest)]
        rows.append(row)
    heads = ("method", "library", "what", "asks for", "constraints", "takes only")
    return Table([Column(head, words=True) for head in heads], rows)


def methods_of(given: Iterable[str] | Mapping[str, Optimiser | str | Method]) -> list[Method]:
    """Methods by names of METHODS, or functions under names of one's own.

    ValueError for an unknown name, with the nearest, or for what cannot be called.
    """
    if isinstance(given, str):
        given = [given]
    pairs = given if isinstance(given, Mapping) else {name: name for name in given}
    if not pairs:
        raise ValueError("no methods; accepted: one at least")
    return [_method(name, one) for name, one in pairs.items()]


def _method(name: str, one: Optimiser | str | Method) -> Method:
    require_kind("method", name, str, "a name")
    if isinstance(one, Method):
        return one
    if isinstance(one, str):
        require_choice("method", one, METHODS)
        return METHODS[one]
    if name in METHODS or not name.strip() or len(name) > 80:
        raise ValueError(
            f"method {shown(name)}{nearest(name, METHODS)}; accepted: a name of your own, of up to "
            "80 characters, that none of METHODS has"
        )
    if not callable(one):
        raise ValueError(f"method {name}: {shown(one)}; accepted: a function of an objective")
    return Method(name, "a function of the user's", _seeded(one))


def _seeded(function: Callable[..., object]) -> Optimiser:
    """The function, with the seed where it takes two arguments."""
    try:
        inspect.signature(function).bind(None, 0)
    except TypeError:
        return _Unseeded(function)
    except ValueError:  # it tells nothing of its arguments
        return function
    return function


@dataclass(frozen=True)
class _Unseeded:
    """A function of an objective alone."""

    function: Callable[..., object]

    def __call__(self, objective: Objective, seed: int) -> object:
        """Without the seed."""
        return self.function(objective)
