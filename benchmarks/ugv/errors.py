"""How wrong answers are: against the default solver in float64, and that against brentq."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np

from benchmarks.ugv.program import Way, given, program
from stickslip.dynamics.ugv import Track, UGVParams

WEIGHT, RADIUS = float(UGVParams().weight), float(UGVParams().wheel_radius)


class Truth(NamedTuple):
    """The postures that errors are taken over, and their answers: float64, solved to rounding."""

    x: np.ndarray
    angles: np.ndarray
    answer: dict[str, np.ndarray]


def truth_of(track: Track, batch: int) -> Truth:
    """The default solver's answers in float64."""
    with jax.enable_x64(True):
        arguments = given(track, "float64", batch)
        found = program(Way(), *arguments).call(*arguments)
        answer = {name: np.asarray(of) for name, of in found._asdict().items()}
        return Truth(np.asarray(arguments[1]), np.asarray(arguments[2]), answer)


def errors_of(found: dict[str, Any], truth: Truth) -> dict[str, float]:
    """Largest errors over the postures that both have, which are the first ones.

    torque_error: over weight times radius [-]. force_error: of all four forces, over the weight
    [-]. contact_error: of the rear contact [m]. pitch_error [rad]. failed: share of statuses other
    than the reference's.
    """
    count = min(len(truth.x), len(found["torque"]))

    def off(name: str) -> float:
        wanted = truth.answer[name][:count]
        return float(np.max(np.abs(np.asarray(found[name], float)[:count] - wanted)))

    good = np.asarray(found["status"])[:count] == 0
    return {
        "torque_error": off("torque") / WEIGHT / RADIUS,
        "force_error": max(off(name) for name in ("F_rear", "N_rear", "F_front", "N_front"))
        / WEIGHT,
        "contact_error": off("x_rear"),
        "pitch_error": off("pitch"),
        "failed": float(np.mean(good != (truth.answer["status"][:count] == 0))),
    }
