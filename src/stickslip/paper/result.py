"""Result of a figure's module: columns of data, a drawing and claims with a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.dynamics.checks import require_integer

AGREES = "agrees"
PARTLY = "partly"
DIFFERS = "differs"
BY_CALIBRATION = "by calibration"
"""The default masses were chosen so that this number comes out: no evidence."""
BY_CONSTRUCTION = "by construction"
"""It comes out so for every robot and every parameter: a check of the computation, no evidence."""
NOT_STATED = "not stated"
"""The chapter prints a curve or nothing; the measurement is ours alone."""
VERDICTS = (AGREES, PARTLY, DIFFERS, BY_CALIBRATION, BY_CONSTRUCTION, NOT_STATED)

Columns = Mapping[str, np.ndarray | Sequence[Any]]
"""Names with units, and equally long columns of numbers or words; NaN is an empty cell."""


@dataclass(frozen=True)
class Claim:
    """A claim of the chapter, the measurement, a verdict and its reason.

    verdict: one of VERDICTS.
    """

    stated: str
    measured: str
    verdict: str
    why: str

    def __post_init__(self):
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict = {self.verdict!r}; accepted: {', '.join(VERDICTS)}")


def verdict_of(agrees: object, partly: object = False) -> str:
    """AGREES, PARTLY or DIFFERS by two conditions."""
    return AGREES if agrees else PARTLY if partly else DIFFERS


def share_of(holds: Iterable[object]) -> str:
    """AGREES where every case holds, PARTLY where some do, DIFFERS where none does or none is."""
    cases = [bool(one) for one in holds]
    return verdict_of(cases and all(cases), any(cases))


def by_construction(holds: object) -> str:
    """For what cannot come out otherwise: where it does, DIFFERS, for the computation is wrong."""
    return BY_CONSTRUCTION if holds else DIFFERS


def by_calibration(holds: object) -> str:
    """For a number that the default masses were chosen for; DIFFERS where it does not come out."""
    return BY_CALIBRATION if holds else DIFFERS


@dataclass(frozen=True)
class Setting:
    """Resolution of a figure.

    samples: points a step of the biped. They are integration steps, too, split at every switching
    instant, so a coarse grid costs few digits. Of Fig. 24's curves: points along the bump. say:
    told what is being computed, for progress.
    """

    samples: int = 240
    say: Callable[[str], None] = lambda what: None

    def __post_init__(self):
        accepted = "24 to 2400 points a step"
        require_integer("samples", self.samples, low=24, high=2400, accepted=accepted)


@dataclass(frozen=True)
class Result:
    """One figure: its tables by file ending ("" for the curves), how to draw it, its claims.

    draw: takes nothing and returns a matplotlib figure; called only where a picture is wanted.
    """

    tables: Mapping[str, Columns]
    draw: Callable[[], Any]
    claims: Sequence[Claim]
