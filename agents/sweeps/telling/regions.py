"""Where on the axes something happens, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.design import SAMPLE

if TYPE_CHECKING:
    from stickslip.agents.sweeps.reading import SweepArrays

BINS = 8
"""Of a random axis."""
CHANCE = 3.0
"""Standard deviations of a difference that chance does not reach."""
TELLING = 2.0
"""An axis tells where something is if its greatest share is so many times its least."""


def where(shares: np.ndarray, dims: tuple[str, ...], of: SweepArrays) -> str:
    """'mu up to 0.06, payload from 9 kg on', or '' where no axis tells.

    shares: over `dims`, how much of it there is at a point, 0 to 1. An axis is told of where the
    mean over all others is twice as large at its greatest as at its least (of a random axis, and by
    more than chance makes it); its values are those in one piece around the greatest with at least
    half of that.
    """
    words = []
    for name, (values, means, noise) in along_axes(shares, dims, of).items():
        most, least = means.max(), means.min()
        if len(values) < 2 or most <= 0 or most < TELLING * least or most - least < noise:
            continue
        first = last = int(np.argmax(means))
        while first > 0 and means[first - 1] >= most / 2:
            first -= 1
        while last < len(means) - 1 and means[last + 1] >= most / 2:
            last += 1
        words.append(_piece(name, values, first, last, of.units.get(name, "-")))
    return ", ".join(word for word in words if word)


def along_axes(
    shares: np.ndarray, dims: tuple[str, ...], of: SweepArrays
) -> dict[str, tuple[np.ndarray, np.ndarray, float]]:
    """By axis its values in order, the mean over all others at each, and how far chance alone may
    bring two of these apart. What is no number is left out, NaN where nothing is left."""
    found, known = {}, np.ma.masked_invalid(shares)
    for place, dim in enumerate(dims):
        others = tuple(i for i in range(len(dims)) if i != place)
        means = np.ma.filled(known.mean(axis=others), np.nan) if others else shares
        if dim != SAMPLE:
            order = np.argsort(of.coordinates[dim])
            found[dim] = (of.coordinates[dim][order], means[order], 0.0)
            continue
        for name in (n for n in of.coordinates if n not in (*of.dims, SAMPLE)):
            order = np.argsort(of.coordinates[name])
            parts = np.array_split(order, min(BINS, len(order)))
            middles = np.asarray([of.coordinates[name][part].mean() for part in parts])
            noise = CHANCE * float(means.std()) * np.sqrt(2 / max(1, len(order) // len(parts)))
            found[name] = (middles, np.asarray([means[part].mean() for part in parts]), noise)
    return found


def _piece(name: str, values: np.ndarray, first: int, last: int, unit: str) -> str:
    tail = "" if unit == "-" else f" {unit}"
    low, high = f"{values[first]:.3g}{tail}", f"{values[last]:.3g}{tail}"
    if first == 0 and last == len(values) - 1:
        return ""
    if first == 0:
        return f"{name} up to {high}" if last else f"{name} = {low}"
    if last == len(values) - 1:
        return f"{name} from {low} on" if first < last else f"{name} = {high}"
    return f"{name} from {low} to {high}" if first < last else f"{name} = {low}"
