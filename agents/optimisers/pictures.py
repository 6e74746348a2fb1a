"""Pictures of results: ECDFs, profiles, expected running times, feasibility, hypervolume."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.drawn import IN_WORDS, legend, panels, styles, titled
from stickslip.agents.optimisers.measures import (
    TARGETS,
    Cost,
    Expected,
    costs,
    ecdf,
    ert,
    gaps,
    profile,
    share_feasible,
)
from stickslip.agents.pictures.sheet import save_sheet
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.optim.instances.catalogue import suite

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from stickslip.agents.optimisers.drawn import Style
    from stickslip.agents.optimisers.results import Run

CLOSE = 0.01
"""The gap of expected running times and profiles."""
UNITS = {"evaluations": "evaluations / free numbers", "seconds": "processor time [s]"}
MANY, PANELS, TOP = 60, 6, 2e4
LEVELS = 10.0 ** np.arange(2, -4.1, -0.25)


def draw_report(runs: Sequence[Run], folder: Path, stem: str = "optimisers") -> list[Path]:
    """All pictures that there is something for, at most six; their paths."""
    own = styles(runs)
    single = [run for run in runs if len(suite()[run.instance].goals) == 1]
    several = [run for run in runs if len(suite()[run.instance].goals) > 1]
    counted = [run for run in single if not run.inside]
    timed = [run for run in single if np.all(np.isfinite(run.seconds))]
    found = []
    by_cost: dict[Cost, list[Run]] = {"evaluations": counted, "seconds": timed}
    for cost, which in by_cost.items():
        if which:
            path = folder / f"{stem}_ecdf_{cost}.png"
            found.append(_distributions(which, cost, own, path))
    if counted:
        found += [
            _profiles(counted, timed, own, folder / f"{stem}_profiles.png"),
            _expected(counted, own, folder / f"{stem}_ert.png"),
            _feasible(counted, own, folder / f"{stem}_feasible.png"),
        ]
    if several:
        found.append(_hypervolumes(several, own, folder / f"{stem}_hypervolume.png"))
    return found


def families(runs: Sequence[Run]) -> list[str]:
    """Those that there are runs of, in the order of IN_WORDS."""
    there = {suite()[run.instance].family for run in runs}
    return [name for name in IN_WORDS if name in there]


def _of(runs: Sequence[Run], family: str, method: str = "") -> list[Run]:
    return [
        run for run in runs if suite()[run.instance].family == family and method in ("", run.method)
    ]


def _distributions(runs: Sequence[Run], cost: Cost, own: dict[str, Style], path: Path) -> Path:
    """A panel a family: the share of run and target pairs hit."""
    names = families(runs)
    title = f"Targets hit, by {cost}: {len(TARGETS)} gaps from {TARGETS[0]:g} to {TARGETS[-1]:g}"
    figure, axes = panels(len(names), title)
    for axis, name in zip(axes, names, strict=True):
        there = _of(runs, name)
        for method in dict.fromkeys(run.method for run in there):
            mine = _of(there, name, method)
            at, share = ecdf(mine, cost)
            size = (
                (lambda run: suite()[run.instance].n) if cost == "evaluations" else (lambda run: 1)
            )
            last = max(costs(run, cost)[-1] / size(run) for run in mine)
            _steps(axis, at, share, last, own[method])
        axis.set_xscale("log")
        axis.xaxis.set_minor_formatter(require("matplotlib.ticker").NullFormatter())
        axis.set_ylim(0, 1.02)
        count = len({run.instance for run in there})
        titled(axis, f"{IN_WORDS[name]}, {count} instance{'s'[: count > 1]}", UNITS[cost])
    legend(figure, own, [name for name in own if any(run.method == name for run in runs)])
    return save_sheet(figure, path)


def _steps(axis: Axes, at: np.ndarray, share: np.ndarray, last: float, style: Style) -> None:
    """A distribution, and a cross where the runs end."""
    end = share[-1] if len(share) else 0.0
    x, y = np.append(at, max(last, at[-1] if len(at) else last)), np.append(share, end)
    axis.step(x, y, where="post", color=style.colour, linestyle=style.dash, lw=1.4)
    axis.plot(x[-1], end, "x", color=style.colour, markersize=4)


def _profiles(
    counted: Sequence[Run], timed: Sequence[Run], own: dict[str, Style], path: Path
) -> Path:
    """Performance profiles over evaluations and over time."""
    figure, axes = panels(2, f"Performance profiles at a gap of {CLOSE:g}", width=4.4, height=3.2)
    shown: dict[str, None] = {}
    by_cost: dict[Cost, Sequence[Run]] = {"evaluations": counted, "seconds": timed}
    for axis, (cost, runs) in zip(axes, by_cost.items(), strict=True):
        for method, (ratio, share) in profile(runs, CLOSE, cost).items():
            if len(ratio):
                shown[method] = None
                _steps(axis, ratio, share, 1e3, own[method])
        axis.set_xscale("log")
        axis.set_xlim(0.95, 1e3)
        axis.set_ylim(0, 1.02)
        which = "evaluations" if cost == "evaluations" else "processor time"
        titled(axis, which, "factor of the best method's expected running time", "")
    axes[0].set_ylabel("share of instances", fontsize=8.5, color=theme.MUTED)
    legend(figure, own, [name for name in own if name in shown])
    return save_sheet(figure, path)


def _expected(runs: Sequence[Run], own: dict[str, Style], path: Path) -> Path:
    """Expected running time over the gap, with intervals, where the foot sticks or slips."""
    names = list(dict.fromkeys(run.instance for run in runs))
    which = ([name for name in names if suite()[name].family == "shooting"] or names)[:PANELS]
    figure, axes = panels(len(which), "Expected running time by gap, 95 % of a bootstrap over runs")
    shown: dict[str, None] = {}
    for axis, name in zip(axes, which, strict=True):
        there = [run for run in runs if run.instance == name]
        for place, method in enumerate(dict.fromkeys(run.method for run in there)):
            found = [ert([run for run in there if run.method == method], at) for at in LEVELS]
            known = np.isfinite([one.value for one in found])
            if np.any(known):
                shown[method] = None
                met = [one for one, is_known in zip(found, known, strict=True) if is_known]
                _with_intervals(axis, LEVELS[known] * 1.012**place, met, own[method])
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.invert_xaxis()
        _plain_ticks(axis)
        titled(axis, name, "gap to the best known", "evaluations" if axis is axes[0] else "")
    legend(figure, own, [name for name in own if name in shown])
    return save_sheet(figure, path)


def _with_intervals(axis: Axes, at: np.ndarray, found: Sequence[Expected], style: Style) -> None:
    """A line with the intervals as bars, up to the top where they have no end."""
    value, low, high = (
        np.array([getattr(one, part) for one in found]) for part in ("value", "low", "high")
    )
    high = np.where(np.isfinite(high), high, TOP)
    axis.plot(at, value, color=style.colour, linestyle=style.dash, lw=1.3,
              marker=style.marker, markersize=3)  # fmt: skip
    axis.vlines(at, np.maximum(low, 1), high, color=style.colour, lw=0.6, alpha=0.45)
    axis.set_ylim(0.8, TOP)


def _plain_ticks(axis: Axes) -> None:
    """Names at powers of ten alone."""
    for one in (axis.xaxis, axis.yaxis):
        one.set_minor_formatter(require("matplotlib.ticker").NullFormatter())


def _feasible(runs: Sequence[Run], own: dict[str, Style], path: Path) -> Path:
    """The share of runs with a feasible point over evaluations, where points can be infeasible."""
    at = 10.0 ** np.linspace(-2, 2.3, MANY)
    hard = [
        name
        for name in families(runs)
        if any(np.any(run.violations > 0) for run in _of(runs, name))
    ] or families(runs)[:1]
    figure, axes = panels(len(hard), "Runs that found a feasible point")
    for axis, name in zip(axes, hard, strict=True):
        there = _of(runs, name)
        for method in dict.fromkeys(run.method for run in there):
            share = share_feasible(_of(there, name, method), at)
            style = own[method]
            axis.step(at, share, where="post", color=style.colour, linestyle=style.dash, lw=1.4)
        axis.set_xscale("log")
        axis.set_ylim(-0.02, 1.02)
        titled(
            axis, IN_WORDS[name], UNITS["evaluations"], "share of runs" if axis is axes[0] else ""
        )
    legend(figure, own, [name for name in own if any(run.method == name for run in runs)])
    return save_sheet(figure, path)


def _hypervolumes(runs: Sequence[Run], own: dict[str, Style], path: Path) -> Path:
    """The missing share of hypervolume over evaluations, a line a run."""
    names = list(dict.fromkeys(run.instance for run in runs))
    figure, axes = panels(
        len(names), "Hypervolume that is missing, in parts of the known front's", width=4.4
    )
    for axis, name in zip(axes, names, strict=True):
        for run in (one for one in runs if one.instance == name and not one.inside):
            style, missing = own[run.method], gaps(run)
            at = np.append(1, run.evaluations)
            share = np.append(1.0, np.where(np.isfinite(missing), missing, 1.0))
            axis.step(at, share, where="post", color=style.colour, linestyle=style.dash, lw=1.3)
            axis.plot(at[-1], share[-1], "x", color=style.colour, markersize=4)
        axis.set_ylim(0, 1.03)
        axis.set_xscale("log")
        titled(axis, name, "evaluations", "")
    legend(figure, own, [name for name in own if any(run.method == name for run in runs)])
    return save_sheet(figure, path)
