"""Objective of a gait: a name of OBJECTIVES or a weighted sum of some."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from stickslip.dynamics.checks import require_choice, require_known, shown
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.problem import require_scalar

TIME, TORQUE, WORK, STRAIN = "time", "torque", "work", "torque_over_phase"
"""Terms of an objective: time [s]; torque^2 over time [(N m)^2 s]; positive work [J]; torque^2 over
the crank angle [(N m)^2 rad]."""
FRICTION = "friction"
TERMS_OF: dict[str, tuple[str, ...]] = {
    "time": (TIME,),
    "torque": (TORQUE,),
    "torque_over_phase": (STRAIN,),
    "work": (WORK,),
    "energy": (WORK, TORQUE),
}
"""Terms that a name adds up, the copper loss with the last one of "energy"."""
UNITS: dict[str, str] = {
    "time": "s",
    "torque": "(N m)^2 s",
    "torque_over_phase": "(N m)^2 rad",
    "work": "J",
    "energy": "J",
    FRICTION: "-",
}


@dataclass(frozen=True)
class Goal:
    """words: as it was asked for. weights: of the terms, in SI units; none for the least friction
    demand, which is a quotient and no sum."""

    words: str
    unit: str
    weights: dict[str, float]

    @property
    def is_friction(self) -> bool:
        return not self.weights

    def of(self, spent: Mapping[str, float]) -> float:
        return sum(weight * spent[term] for term, weight in self.weights.items())


def goal_of(objective: str | Mapping[str, float], copper_loss: float) -> Goal:
    """The goal, or ValueError for an unknown name, a weight below 0 or none above it."""
    if isinstance(objective, str):
        require_choice("objective", objective, tuple(OBJECTIVES))
        weights = {} if objective == FRICTION else _weights({objective: 1.0}, copper_loss)
        return Goal(objective, UNITS[objective], weights)
    if not isinstance(objective, Mapping):
        raise ValueError(
            f"objective = {shown(objective)}; accepted: {', '.join(OBJECTIVES)}, or a mapping of "
            "names to weights"
        )
    if FRICTION in objective:
        raise ValueError(
            "objective has 'friction' in a sum, of which the best is no convex program; accepted: "
            f"{', '.join(TERMS_OF)} in a sum, and mu as a limit"
        )
    require_known(objective, tuple(TERMS_OF), "objective in a sum")
    for name, weight in objective.items():
        require_scalar(f"weight of {name}", weight, low=0.0, accepted="a finite number >= 0")
    given = {name: float(weight) for name, weight in objective.items() if weight > 0}
    weights = _weights(given, copper_loss)
    if not weights:
        raise ValueError(f"objective = {shown(objective)}; accepted: a weight above 0")
    words = " + ".join(f"{weight:g} {name}" for name, weight in given.items())
    return Goal(words, "weighted", weights)


def _weights(objective: Mapping[str, float], copper_loss: float) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, weight in objective.items():
        for term in TERMS_OF[name]:
            loss = copper_loss if (name, term) == ("energy", TORQUE) else 1.0
            found[term] = found.get(term, 0.0) + weight * loss
    return {term: weight for term, weight in found.items() if weight > 0}
