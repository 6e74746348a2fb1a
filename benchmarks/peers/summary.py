"""What the measurements say: the fastest setting for each accuracy, the aims, a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.peers import c_loop, mujoco_c, ours
from benchmarks.peers.cases import CASES, Measured, fastest
from benchmarks.report import pyplot

COLOURS = {
    "stickslip": "C0",
    "MuJoCo": "C1",
    "MJX": "C2",
    "Pinocchio": "C3",
    "C loop": "0.4",
}


def groups(rows: list[Measured]) -> dict[tuple[str, str, int, int], list[Measured]]:
    """By case, program, batch and threads, in the order of measurement."""
    found: dict[tuple[str, str, int, int], list[Measured]] = {}
    for row in rows:
        if row.program != c_loop.NAME:
            key = (row.case, row.program, row.batch, row.threads)
            found.setdefault(key, []).append(row)
    return found


def at_bounds(rows: list[Measured], bounds: Sequence[float]) -> list[dict[str, Any]]:
    """A line a group: simulated seconds a wall second; a core-second (setting) at each accuracy."""
    table = []
    for (case, program, batch, threads), group in groups(rows).items():
        line = {"walk": case, "program": program, "batch": batch, "threads": threads}
        for bound in bounds:
            best = fastest(group, bound)
            if best is None:
                least = min(row.error for row in group)
                line[f"{bound:g} rad"] = f"not reached ({least:.1e})"
            else:
                rates = f"{_short(best.rate)}; {_short(best.core_rate)}"
                line[f"{bound:g} rad"] = f"{rates} ({best.setting})"
        table.append(line)
    return table


def aims(rows: list[Measured]) -> list[dict[str, str]]:
    """What was asked of stickslip, and what was measured."""
    slip = CASES[1].name
    found = []
    mine = _best(rows, slip, ours.NAME, 1e-4, lambda row: row.batch == ours.BATCH)
    if mine is not None:
        said = f"{_short(mine.rate)} ({mine.threads} threads, {mine.setting}), "
        said += f"{_short(mine.core_rate)} a core-second"
        found.append(_line("1e5 simulated s/s at 1e-4 rad, stick-slip, batch 4096", said))
    own = _best(rows, CASES[0].name, ours.NAME, 1e-4, lambda row: row.batch == ours.BATCH)
    loops = [row for row in rows if row.program == c_loop.NAME]
    for row in loops:
        if own is not None and row.case.startswith("stick"):
            steps, could = own.core_rate / step_of(own), row.core_rate / step_of(row)
            said = f"{steps / could:.0%}: {steps:.2g} steps a core-second ({own.setting}) to "
            said += f"{could:.2g} ({row.setting})"
            found.append(_line("half the C loop's rate a core, sticking, batch 4096", said))
    for bound in (1e-2, 1e-4):
        for case in CASES:
            one = _best(rows, case.name, ours.NAME, bound, lambda row: row.batch == 1)
            peer = _best(rows, case.name, mujoco_c.NAME, bound, lambda row: row.batch == 1)
            what = f"100 times MuJoCo at batch 1, {case.name}, {bound:g} rad"
            if one is not None and peer is not None:
                said = f"{one.core_rate / peer.core_rate:.0f} times"
                said += f" ({_short(one.core_rate)} to {_short(peer.core_rate)} a core-second)"
                found.append(_line(what, said))
            elif one is not None and any(row.program == mujoco_c.NAME for row in rows):
                said = f"{_short(one.core_rate)} a core-second; MuJoCo does not reach it"
                found.append(_line(what, said))
    return found


def step_of(row: Measured) -> float:
    """The step [s] that a setting names last, '... 9.88 ms'."""
    return 1e-3 * float(row.setting.rsplit(", ", 1)[-1].removesuffix(" ms"))


def draw(rows: list[Measured], path: Path) -> None:
    """Error against simulated seconds a second, a panel a case, a line a family of settings."""
    plt = pyplot()
    figure, panels = plt.subplots(
        1, 2, figsize=(11, 5.2), sharex=True, sharey=True, layout="constrained"
    )
    for case, panel in zip(CASES, panels, strict=True):
        for (_, program, batch, threads), group in groups(
            [row for row in rows if row.case == case.name]
        ).items():
            front = [
                row
                for row in group
                if all(row.core_rate >= one.core_rate for one in group if one.error <= row.error)
                and row.error < 1.0
            ]
            front.sort(key=lambda row: row.core_rate)
            label = f"{program}, batch {batch}" if batch > 1 else program
            label += f" on {threads} threads" if threads > 1 else ""
            style = "o-" if batch == 1 else "s--"
            rates, errors = [row.core_rate for row in front], [row.error for row in front]
            panel.loglog(rates, errors, style, color=COLOURS[program], label=label, ms=4)
        panel.set_title(f"{case.name}: least error at each speed")
        panel.set_xlabel("simulated seconds a second of one core")
        panel.grid(alpha=0.3, which="major")
    shown: dict[str, Any] = {}
    for panel in panels:
        shown |= dict(zip(*reversed(panel.get_legend_handles_labels()), strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=4, fontsize=8)
    panels[0].set_ylabel("largest error of the crank's angle [rad]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _best(rows, case: str, program: str, bound: float, where) -> Measured | None:
    return fastest(
        [row for row in rows if (row.case, row.program) == (case, program) and where(row)], bound
    )


def _line(aim: str, measured: str) -> dict[str, str]:
    return {"aim": aim, "measured": measured}


def _short(value: float) -> str:
    """Three digits, with thousands set apart."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
