"""Measured fronts of cost and error as SVG: each point tells its setting when it is pointed at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from math import ceil, floor, log10
from typing import Any, NamedTuple

from benchmarks.fronts import front_of
from benchmarks.report import RESULTS, read_json, where
from benchmarks.tradeoff.points import UNBOUNDED, family, promises_of
from benchmarks.tradeoff.points import short as biped_name
from benchmarks.tradeoff.population import FLOORS, ROBOTS
from benchmarks.ugv.points import points_of, reliable
from benchmarks.ugv.points import short as ugv_name
from documentation.names import ROOT

WIDTH, HEIGHT, LEFT, EDGE, BELOW, ABOVE = 680, 400, 64, 24, 48, 14
WORST = 1.0
"""Errors beyond are of no use, and not shown."""
FLOOR_WORDS = {
    "smooth": "a floor that holds",
    "stick-slip": "one friction of 0.02 to 0.5",
    "ice": "patches of high and low friction",
}
HINT = "Point at a mark, or reach it with the Tab key, for its setting."


class Mark(NamedTuple):
    """A point of a panel: its words, its style's name, whether nothing beats it."""

    cost: float
    error: float
    about: str
    style: str
    first: bool


class Scale(NamedTuple):
    """A logarithmic axis over whole powers of ten, onto pixels."""

    low: int
    high: int
    start: float
    end: float

    def __call__(self, value: float) -> float:
        """Where a value stands [px]."""
        share = (log10(value) - self.low) / (self.high - self.low)
        return round(self.start + share * (self.end - self.start), 1)


def biped() -> str:
    """What is promised of the default robot, on each kind of floor."""
    content = read_json(ROOT / RESULTS / "tradeoff.json")
    parts = [_caption(where(content, "population"))]
    for scene in FLOORS:
        points = promises_of(content, scene, ROBOTS[0], 4096)
        points = [point for point in points if point.error < min(WORST, UNBOUNDED)]
        marks = _marks(
            points,
            lambda p: (
                f"{biped_name(p)}: 95 % of walks within {p.error:.1e} rad/s, half within "
                f"{p.typical:.1e}; {p.cost:.1e} s for a simulated second"
            ),
            lambda p: f"{family(p.integrator)}, {p.dtype}",
        )
        axes = "processor time for a simulated second of one of 4096 environments [s]"
        parts.append(panel(f"Biped: {FLOOR_WORDS[scene]}", marks, axes, "promised error [rad/s]"))
    return "\n".join(parts)


def ugv() -> str:
    """Every setting of poses and forces, on each of the gentle tracks."""
    content = read_json(ROOT / RESULTS / "ugv.json")
    parts = [_caption(where(content, "trade"))]
    rows = content["trade"]
    batch = max(row["batch"] for row in rows)
    for track in dict.fromkeys(row["track"] for row in rows):
        points = [p for p in reliable(points_of(rows, track, batch)) if p.error < WORST]
        marks = _marks(
            points,
            lambda p: (
                f"{ugv_name(p)}: error {p.error:.1e} of forces and contacts; "
                f"{p.cost:.1e} s a pose".replace("\n", ", ")
            ),
            lambda p: f"{'closed form' if p.pieces is None else p.interpolation}, {p.dtype}",
        )
        axes = f"processor time for a pose, {batch} at once [s]"
        parts.append(panel(f"UGV: {track}", marks, axes, "relative error [-]"))
    return "\n".join(parts)


def panel(title: str, marks: Sequence[Mark], below: str, beside: str) -> str:
    """A figure with its legend; lines of HTML without an empty one, as Markdown wants it."""
    x = Scale(*_decades([mark.cost for mark in marks]), LEFT, WIDTH - EDGE)
    y = Scale(*_decades([mark.error for mark in marks]), HEIGHT - BELOW, ABOVE)
    styles = sorted({mark.style for mark in marks})
    lines = [
        '<figure class="front" markdown="0">',
        f"<figcaption>{escape(title)}</figcaption>",
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="group" aria-label="{escape(title)}">',
        *_grid(x, y, below, beside),
        _steps([mark for mark in marks if mark.first], x, y),
    ]
    for mark in sorted(marks, key=lambda one: one.first):
        kind = f"mark style-{styles.index(mark.style)}" + ("" if mark.first else " beaten")
        reach = ' tabindex="0"' if mark.first else ""
        about = escape(mark.about)
        lines.append(
            f'<circle class="{kind}" cx="{x(mark.cost)}" cy="{y(mark.error)}" r="5"{reach} '
            f'data-about="{about}" aria-label="{about}"><title>{about}</title></circle>'
        )
    lines += ["</svg>", '<p class="front-legend">']
    lines += [f'<span class="style-{n}">● {escape(name)}</span>' for n, name in enumerate(styles)]
    lines += ["</p>", f'<p class="front-note" aria-live="polite">{HINT}</p>', "</figure>", ""]
    return "\n".join(lines)


def _marks(
    points: Sequence[Any], about: Callable[[Any], str], style: Callable[[Any], str]
) -> list[Mark]:
    first = front_of(points)
    return [Mark(p.cost, p.error, about(p), style(p), p in first) for p in points]


def _decades(values: Sequence[float]) -> tuple[int, int]:
    return floor(log10(min(values))), max(ceil(log10(max(values))), floor(log10(min(values))) + 1)


def _grid(x: Scale, y: Scale, below: str, beside: str) -> list[str]:
    bottom, right = HEIGHT - BELOW, WIDTH - EDGE
    lines = ['<g class="grid">']
    for power in range(x.low, x.high + 1):
        at = x(10.0**power)
        lines.append(f'<path d="M{at} {ABOVE}V{bottom}"/>')
        lines.append(f'<text x="{at}" y="{bottom + 18}" text-anchor="middle">1e{power}</text>')
    for power in range(y.low, y.high + 1):
        at = y(10.0**power)
        lines.append(f'<path d="M{LEFT} {at}H{right}"/>')
        lines.append(f'<text x="{LEFT - 6}" y="{at + 4}" text-anchor="end">1e{power}</text>')
    middle = (LEFT + right) / 2
    lines.append(f'<text x="{middle}" y="{HEIGHT - 8}" text-anchor="middle">{below}</text>')
    lines.append(
        f'<text transform="translate(14 {bottom / 2}) rotate(-90)" text-anchor="middle">'
        f"{beside}</text></g>"
    )
    return lines


def _steps(first: Sequence[Mark], x: Scale, y: Scale) -> str:
    """The front: cheapest first, level until the next that is more accurate."""
    first = sorted(first, key=lambda one: (one.cost, one.error))
    ways = [f"{x(one.cost)} {y(one.error)}" for one in first[:1]]
    ways += [f"H{x(one.cost)}V{y(one.error)}" for one in first[1:]]
    return f'<path class="front-line" d="M{"".join(ways)}"/>'


def _caption(measured: str) -> str:
    return f"Measured on {measured}.\n"
