"""Scales of a sweep's pictures: cells and ticks at the values that were played, colours that one
point does not stretch."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

FEW = 10
"""Values of an axis that all have a tick, where there is room."""
WIDE, HIGH = 3.2, 1.9
"""Of the smallest picture's axes [inches]."""
A_DIGIT, A_LINE, BETWEEN = 0.08, 0.17, 0.09
"""Sizes of a tick's label [inches]."""
FAR = 10.0
"""Values farther out than so many times the spread of most are beyond the colours."""
TRIMMED = 20
"""One value in so many, at least one, is not counted among most at either end."""
SMALL = 1e-3
"""Colours span at least this share of the values' size."""


class Colours(NamedTuple):
    """Where colours begin and end. below, above: the ends of what is beyond, None for nothing."""

    low: float
    high: float
    below: float | None
    above: float | None

    @property
    def extend(self) -> str:
        """The ends of the bar that have an arrow."""
        ends = (self.below is not None, self.above is not None)
        return {(True, True): "both", (True, False): "min", (False, True): "max"}.get(
            ends, "neither"
        )

    @property
    def words(self) -> str:
        """What the arrows stand for."""
        words = [] if self.below is None else [f"down to {plain_number(self.below)}"]
        words += [] if self.above is None else [f"up to {plain_number(self.above)}"]
        return f"arrow: {' and '.join(words)}" if words else ""


def colours_of(
    values: np.ndarray, calm: np.ndarray, least: float | None, span: float = 0.0
) -> Colours:
    """Colours for values of which some may lie far out, as penalties do.

    calm: where no episode failed; the spread of most is that of these points, without the outermost
    of them, and of all points where too few are calm. Values beyond FAR times that are left to the
    bar's arrows. least: where colours begin, None for the least value. span: at least.
    """
    known = np.sort(values[np.isfinite(values)])
    if not known.size:
        known = np.zeros(1)
    most = np.sort(values[np.isfinite(values) & calm])
    if most.size < max(3, known.size / 8):
        most = known
    cut = max(1, most.size // TRIMMED) if most.size > 4 else 0
    core = most[cut : most.size - cut]
    far = FAR * (core[-1] - core[0])
    near = known[(known >= core[0] - far) & (known <= core[-1] + far)] if far > 0 else known
    low, high = float(near[0] if least is None else least), float(near[-1])
    below = float(known[0]) if known[0] < low else None
    above = float(known[-1]) if known[-1] > high else None
    span = max(span, SMALL * max(abs(low), abs(high)))
    if high - low < span:
        low = low if least is not None else (low + high - span) / 2
        high = low + span
    return Colours(low, high, below, above)


def cells(x: np.ndarray, y: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, ...]:
    """Edges of both axes, and the values [x, y] as maps take them, all in order."""
    rows, columns = np.argsort(x), np.argsort(y)
    return edges(x[rows]), edges(y[columns]), values[np.ix_(rows, columns)].T


def edges(values: np.ndarray) -> np.ndarray:
    """Of cells around values that rise; in the logarithm where they rise so."""
    if len(values) < 2:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    log = logarithmic(values)
    here = np.log(values) if log else values
    middle = (here[1:] + here[:-1]) / 2
    found = np.concatenate([[2 * here[0] - middle[0]], middle, [2 * here[-1] - middle[-1]]])
    return np.exp(found) if log else found


def logarithmic(values: np.ndarray) -> bool:
    """Whether values that rise do so by one factor."""
    if len(values) < 3 or values.min() <= 0:
        return False
    ratios = values[1:] / values[:-1]
    return bool(np.allclose(ratios, ratios[0], rtol=1e-3)) and ratios[0] > 1


def scale_axis(axes: Axes, which: str, values: np.ndarray, wide: float = WIDE) -> None:
    """Scale of one axis, "x" or "y", for the values that were played, with plain ticks within them.

    wide: of the axes [inches].
    """
    ticker, values = require("matplotlib.ticker"), np.unique(values)
    log = logarithmic(values)
    if log:
        getattr(axes, f"set_{which}scale")("log")
    shown = ticks(values, log, wide if which == "x" else HIGH, which == "x")
    axis: Axis = getattr(axes, f"{which}axis")
    axis.set_major_locator(ticker.FixedLocator(shown))
    axis.set_major_formatter(ticker.FixedFormatter(labels(shown)))
    axis.set_minor_locator(ticker.NullLocator())


def ticks(values: np.ndarray, log: bool, room: float, across: bool) -> np.ndarray:
    """Of an axis: the values themselves where they are few, else round numbers within them, as many
    as have room [inches] for their labels, side by side (across) or one above the other."""
    at = values
    if len(values) > FEW:
        at = _round(values[0], values[-1], log)
    text = labels(at)
    size = A_DIGIT * max(map(len, text)) + BETWEEN if across else A_LINE
    place = np.log(at) if log else at
    ends = np.log(values[[0, -1]]) if log else values[[0, -1]]
    apart = (ends[1] - ends[0]) * size / room
    kept = [0]
    for i in range(1, len(at)):
        last = i == len(at) - 1
        if last and place[i] - place[kept[-1]] < apart and len(kept) > 1:
            kept.pop()
        if last or place[i] - place[kept[-1]] >= apart:
            kept.append(i)
    return at[kept]


def _round(low: float, high: float, log: bool) -> np.ndarray:
    """Round numbers from low to high, or both where there are none."""
    if log:
        tens = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        found = np.outer(tens, (1, 2, 5)).ravel()
    else:
        found = require("matplotlib.ticker").MaxNLocator(6).tick_values(low, high)
    slack = 1e-9 * (high - low)
    found = np.clip(found[(found >= low - slack) & (found <= high + slack)], low, high)
    return found if len(found) > 1 else np.array([low, high])


def labels(values: np.ndarray) -> list[str]:
    """Plain numbers with the fewest digits that tell them apart and show them to a hundredth of
    what lies between."""
    apart = np.diff(values).min() if len(values) > 1 else np.abs(values).max()
    text: list[str] = []
    for digits in range(2, 16):
        text = [plain_number(one, digits) for one in values]
        shown = np.array([float(one.replace("−", "-")) for one in text])
        if np.all(np.abs(shown - values) <= 0.01 * apart):
            break
    return text


def plain_number(value: float, digits: int = 3) -> str:
    """Without an exponent, unless it is very small or large."""
    if value != 0 and not 1e-4 <= abs(value) < 1e7:
        text = f"{value:.{digits}g}"
    else:
        text = np.format_float_positional(value, digits, fractional=False, trim="-")
    return text.replace("-", "−")
