"""Forms of `--rate`: a crank rate, or a file of crank rates over time or over the crank angle."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.checks import require_number, shown
from stickslip.optim.columns import ColumnSpec, read_columns, read_text
from stickslip.simulate.torque import Recorded

if TYPE_CHECKING:
    from jaxtyping import Float

RATE = ColumnSpec("crank rate", "rad/s", ("rate", "w"))
BY_TIME = (ColumnSpec("time", "s", ("t",)), RATE)
BY_PHASE = (ColumnSpec("crank angle", "rad", ("phase", "theta")), RATE)
NODES = 4001
"""Crank angles of a step at which the time is known."""
SAME = 1e-6
"""Relative difference of crank rates that are the same, and of an angle to the end of its range."""


@dataclass(frozen=True)
class PhaseRates:
    """Crank rates [rad/s] at crank angles of the supporting leg [rad], straight between them and
    the same in every step."""

    angles: Float[np.ndarray, " n"]
    rates: Float[np.ndarray, " n"]

    @property
    def whole_step(self) -> tuple[Float[np.ndarray, " n+1"], Float[np.ndarray, " n+1"]]:
        """Angles and rates from the first angle to the same in the next step."""
        return np.append(self.angles, self.angles[0] + np.pi), np.append(self.rates, self.rates[0])

    def at(self, times: Float[np.ndarray, " m"], phase: float) -> Float[np.ndarray, " m"]:
        """The rates at times from a phase on."""
        nodes = np.linspace(SUPPORT_START, SUPPORT_END, NODES)
        rates = np.interp(nodes, self.angles, self.rates, period=np.pi)
        pace = np.diff(nodes) * (1 / rates[1:] + 1 / rates[:-1]) / 2
        clock = np.append(0.0, np.cumsum(pace))
        now = np.mod(times + np.interp(phase, nodes, clock), clock[-1])
        return np.interp(now, clock, rates)


Rate = float | Recorded | PhaseRates


def rate_of(text: str) -> Rate:
    """A number [rad/s], or what is in a file. ValueError for what is neither."""
    try:
        number = float(text)
    except ValueError:
        path = Path(text)
        if path.suffix.lower() != ".csv":
            raise ValueError(
                f"rate {shown(text)}; accepted: a number [rad/s], or a .csv of crank rates over "
                "time or crank angle"
            ) from None
        return _read(path)
    require_number("rate", number, accepted="a finite crank rate [rad/s]")
    return number


def _read(path: Path) -> Recorded | PhaseRates:
    head = read_text(path, "a table")[:1000].lower()
    if not any(word in head for word in ("phase", "angle", "theta")):
        times, rates = read_columns(path, BY_TIME).T
        return Recorded(str(path), times, rates, "rates")
    angles, rates = read_columns(path, BY_PHASE).T
    low, high = SUPPORT_START * (1 - SAME), SUPPORT_END * (1 + SAME)
    name, accepted = f"{path}: crank angle", "pi/2 to 3 pi/2 [rad], one step"
    require_number(name, angles, low=low, high=high, accepted=accepted)
    accepted = "above 0 [rad/s], so that the step ends"
    require_number(f"{path}: crank rate", rates, low=0.0, strict=True, accepted=accepted)
    whole = np.ptp(angles) > np.pi * (1 - SAME)
    if whole and abs(rates[-1] - rates[0]) > SAME * rates[0]:
        raise ValueError(
            f"{path}: {rates[-1]:g} rad/s at 3 pi/2 and {rates[0]:g} at pi/2; accepted: the same "
            "rate, which an exchange of support cannot change"
        )
    return PhaseRates(angles[:-1] if whole else angles, rates[:-1] if whole else rates)


def rates_at(rate: Rate, times: Float[np.ndarray, " m"], phase: float) -> Float[np.ndarray, " m"]:
    """The crank rates at times, from a phase on [rad/s]. ValueError beyond a file's."""
    if isinstance(rate, Recorded):
        return rate.at(times)
    if isinstance(rate, PhaseRates):
        return rate.at(times, phase)
    return np.full(len(times), rate)
