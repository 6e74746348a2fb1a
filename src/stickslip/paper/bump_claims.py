"""Claims about Fig. 24, judged by all pairs of leg angles held over the bump."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.optim import Station
from stickslip.paper.result import NOT_STATED, Claim, by_construction, share_of

Pair = tuple[float, float]
"""Angles of the rear and the front leg [degrees]."""


class Tried(NamedTuple):
    """Pairs of leg angles held over the bump. x: of the front wheel [K, m]. wheelbase: of each
    [pairs, m]. stations: [pairs, K]. radius: of the wheels [m]. overlapping: with how many more
    pairs they overlap."""

    pairs: Sequence[Pair]
    x: np.ndarray
    wheelbase: np.ndarray
    stations: Station
    radius: float
    overlapping: int

    @property
    def largest(self) -> np.ndarray:
        """Largest torque of each pair, whichever way it turns [pairs, N m]."""
        return np.max(np.abs(self.stations.torque), axis=1)


def name_of(pair: Pair) -> str:
    """As in 75/120°: rear and front leg."""
    return f"{pair[0]:g}/{pair[1]:g}°"


def demand(at: Station) -> np.ndarray:
    """Largest |F| / N of each drive, of both wheels [n]."""
    wheels = ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    return np.max([np.max(np.abs(F) / N, axis=1) for F, N in wheels], axis=0)


def load(at: Station) -> np.ndarray:
    """Least normal force of each drive, of both wheels [n, N]."""
    return np.min(np.minimum(np.asarray(at.N_rear), np.asarray(at.N_front)), axis=1)


def exists(tried: Tried) -> Claim:
    """That every posture has a torque."""
    finite = np.all(np.isfinite(tried.stations.torque), axis=1)
    return Claim(
        "there is a torque function for any static configuration angles",
        f"{int(np.sum(finite))} of {len(tried.pairs)} pairs have one",
        by_construction(np.all(finite)),
        "held still, a vehicle that has a place has one equilibrium there: three equations for "
        "three unknowns",
    )


def passes(tried: Tried) -> Claim:
    """That the ground can give what these torques need."""
    at, pairs = tried.stations, tried.pairs
    fine = np.all(np.asarray(at.status) == Status.OK, axis=1)
    need, loads = demand(at), load(at)
    clear = np.min(at.clearance, axis=1)
    most, least, low = int(np.argmax(need)), int(np.argmin(loads)), int(np.argmin(clear))
    angles = sorted({angle for pair in pairs for angle in pair})
    step = angles[1] - angles[0]
    return Claim(
        "(the same, passing the bump)",
        f"{int(np.sum(fine))} of {len(pairs)} pairs from {angles[0]} to {angles[-1]}° by {step}° "
        f"pass: |F| / N up to {need[most]:.3f} ({name_of(pairs[most])}), normal forces "
        f"{loads[least]:.0f} N or more ({name_of(pairs[least])}), body and legs "
        f"{1e3 * clear[low]:.0f} mm above the ground or more ({name_of(pairs[low])})",
        share_of(fine),
        "a wheel that lifts, slips or a body that touches would have failed. Radius, friction and "
        f"the legs' range are not in the chapter: {tried.radius:g} m, {np.max(at.friction):g} and "
        f"{angles[0]} to {angles[-1]}° are ours; with any friction above {need[most]:.2f} as many "
        f"pass. With {tried.overlapping} more pairs the wheels overlap",
    )


def drawn(pairs: Sequence[Pair], torques: np.ndarray) -> Claim:
    """The curves of the figure; torques [pairs, K]."""
    largest = np.max(np.abs(torques), axis=1)
    numbers = ", ".join(
        f"{peak:.1f} ({name_of(p)})" for p, peak in zip(pairs, largest, strict=True)
    )
    return Claim(
        "the angles of the curves",
        f"drawn: rear / front {', '.join(map(name_of, pairs))}; largest torque {numbers} N m",
        NOT_STATED,
        "the chapter does not name them. Five with equal angles and the two unlike ones with the "
        "largest torque of all; the other pairs are thin",
    )


def extremes(tried: Tried) -> Claim:
    """The pairs with the largest and the smallest of all largest torques."""
    torque, largest = np.abs(tried.stations.torque), tried.largest
    mixed = np.array([rear != front for rear, front in tried.pairs])
    equal = np.where(mixed, -np.inf, largest)

    def told(which: int) -> str:
        at = tried.x[int(np.argmax(torque[which]))]
        return (
            f"{largest[which]:.1f} N m ({name_of(tried.pairs[which])}, front wheel at {at:.2f} m)"
        )

    base, peak = (np.argsort(np.argsort(of)) for of in (tried.wheelbase, largest))
    return Claim(
        "(the extremes over all pairs)",
        f"largest torque from {told(int(np.argmax(largest)))} to {told(int(np.argmin(largest)))}; "
        f"{int(np.sum(mixed))} of {len(mixed)} pairs are of unlike angles, and of the others "
        f"{told(int(np.argmax(equal)))} needs most",
        NOT_STATED,
        "mirrored pairs need as much the other way. A longer wheelbase has the wheels on the "
        "steepest places one after the other: largest torque and wheelbase have a rank correlation "
        f"of {np.corrcoef(base, peak)[0, 1]:.2f}",
    )


def work(shown: Station, straight: int, rise: float) -> Claim:
    """Of the curves drawn. straight: which has its legs straight down; rise: of the weights [J]."""
    mean = (shown.torque[:, 1:] + shown.torque[:, :-1]) / 2
    done = mean * np.diff(shown.turn, axis=1)
    put_in = np.sum(np.maximum(done, 0), axis=1)
    left = np.sum(done, axis=1)
    return Claim(
        "(the curves' work)",
        f"legs straight down: {put_in[straight]:.1f} J up, where the weights rise by {rise:.1f} J; "
        f"all drawn: {np.min(put_in):.0f} to {np.max(put_in):.0f} J up, "
        f"{np.max(np.abs(left)):.2f} J or less left over the whole bump",
        NOT_STATED,
        "a check: with the legs held, the torque times the wheels' turn is the change of potential "
        "energy, so each curve goes down as much as up, but for the trapezoid rule between points "
        "and the bump's last traces at the ends",
    )
