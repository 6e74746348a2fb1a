"""What is measured: a choice out of fidelity x integrator x dt x table size x dtype."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from benchmarks.tradeoff.scenes import PERIOD
from stickslip.dynamics.biped import (
    RK4,
    Chebyshev,
    Euler,
    EventExact,
    Joint,
    Paper,
    Reduced,
    RK4Split,
    SemiImplicitEuler,
    Table,
)
from stickslip.dynamics.biped.trade.setting import Setting

if TYPE_CHECKING:
    from stickslip.dynamics.biped.fidelity import Fidelity
    from stickslip.dynamics.biped.stepping.integrators import Integrator

ALL = ("smooth", "stick-slip", "lift-off", "ice", "long")
SHORT = ("smooth", "stick-slip")
NO_ICE = ("smooth", "stick-slip", "lift-off", "long")
PROMISED = ("smooth", "stick-slip", "ice")
"""Scenes of which `recommend` speaks."""
SLIPS = ("uniform",)
EVERYWHERE = ("uniform", "patches")
BATCH = 4096

FIRST = (1, 4, 16, 64)
"""Steps a control period for methods of first order: 20, 5, 1.25 and 0.3125 ms."""
FOURTH = (1, 2, 4, 8, 16)
"""For methods of fourth order: 20 to 1.25 ms."""
LONG = 8
"""The most steps a control period on the long walk."""

ROUGH = EventExact(rtol=1e-4, atol=1e-7)
MIDDLE = EventExact(rtol=1e-7, atol=1e-10)
TIGHT = EventExact(rtol=1e-10, atol=1e-13)


@dataclass(frozen=True)
class Case:
    """One static setting; what is compiled once and run with every step size.

    counts: steps a control period. walks: names of scenes. events: kinds of floor on which the
    switching instants are compared, too. batch: environments stepped together for the second
    cost; batched: the walks that it is measured on.
    """

    fidelity: Fidelity
    integrator: Integrator
    dtype: str = "float64"
    counts: tuple[int, ...] = FOURTH
    walks: tuple[str, ...] = ALL
    events: tuple[str, ...] = ()
    batch: int = BATCH
    batched: tuple[str, ...] = ALL[:-1]

    def counts_on(self, walk: str) -> tuple[int, ...]:
        """Steps a control period on this walk."""
        return tuple(n for n in self.counts if walk != "long" or n <= LONG)


def cases(quick: bool) -> list[Case]:
    """Every case, the cheapest first; quick: enough of them to try the whole way."""
    table = Table()
    if quick:
        short = ("smooth", "stick-slip", "ice")
        return [
            Case(table, RK4Split(), "float32", (1, 4), short),
            Case(table, RK4Split(), "float64", (1, 4, 16), SHORT, SLIPS),
            Case(table, Euler(), "float64", (1, 16), ("stick-slip",)),
        ]
    integrators = [
        Case(table, Euler(), "float64", FIRST, NO_ICE, SLIPS),
        Case(table, SemiImplicitEuler(), "float64", FIRST, NO_ICE, SLIPS),
        Case(table, RK4(), "float64", FIRST, NO_ICE, SLIPS),
        Case(table, RK4Split(), events=EVERYWHERE),
        Case(table, ROUGH, "float64", (1,), ALL, SLIPS, batched=PROMISED),
        Case(table, MIDDLE, counts=(1,), events=EVERYWHERE, batched=PROMISED),
        Case(Table(64, 9), TIGHT, "float64", (1,), ALL, SLIPS, batched=PROMISED),
    ]
    single = [
        Case(table, RK4Split(), "float32", FOURTH),
        Case(table, ROUGH, "float32", (1,), SHORT),
    ]
    tables = [
        Case(Table(8, 4), RK4Split(), "float32", (1, 2, 4), ("smooth", "stick-slip", "ice")),
        Case(Table(16, 5), RK4Split(), "float64", (1, 2, 4, 8), ALL[:3]),
        Case(Table(64, 9), RK4Split(), "float64", (*FOURTH, 64)),
        Case(Chebyshev(48), RK4Split(), "float64", (1, 4), SHORT),
        Case(Chebyshev(96), RK4Split(), "float64", (1, 4, 16), SHORT),
    ]
    exact = [
        Case(Reduced(), RK4Split(), "float64", (1, 4, 16), SHORT),
        Case(Joint(), RK4Split(), "float64", (1, 4), SHORT, batch=64, batched=SHORT[1:]),
        Case(Paper(1e-3), Euler(), "float64", FIRST, SHORT, batch=64, batched=SHORT[1:]),
        Case(Paper(1e-5), Euler(), "float64", FIRST, ("smooth",), batched=()),
    ]
    return integrators + single + tables + exact


def promised(quick: bool) -> list[Setting]:
    """The settings measured on the population; steps of the default robot."""
    table, fine = Table(), Table(64, 9)

    def split(fidelity: Table, dtype: str, *counts: int) -> list[Setting]:
        return [Setting(fidelity, RK4Split(), PERIOD / n, dtype) for n in counts]

    if quick:
        return split(table, "float32", 1, 4)
    return [
        *split(Table(8, 4), "float32", 1, 2),
        *split(table, "float32", 1, 2, 4, 8),
        *split(table, "float64", 1, 2, 4, 8, 16),
        *split(fine, "float64", 16, 64),
        Setting(table, ROUGH, PERIOD, "float64"),
        Setting(table, MIDDLE, PERIOD, "float64"),
        Setting(fine, TIGHT, PERIOD, "float64"),
    ]


def code(spec: Any) -> str:
    """The expression that makes a fidelity or an integrator; defaults left out."""
    given = [
        f"{field.name}={getattr(spec, field.name)!r}"
        for field in fields(spec)
        if getattr(spec, field.name) != field.default or isinstance(spec, Table | Chebyshev)
    ]
    return f"{type(spec).__name__}({', '.join(given)})"
