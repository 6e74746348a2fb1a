"""A sweep as a page: what was varied, what came of it, curves over its axes, and a few episodes."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple

from stickslip.agents.reports.course import sameness
from stickslip.agents.reports.writing import REPORT, write_page, written_or_told
from stickslip.agents.shown_names import shown_name
from stickslip.agents.sweeps.files.directory import read_about
from stickslip.agents.sweeps.reading import sweep_arrays
from stickslip.agents.sweeps.telling.again import MOST_STEPS, play_again
from stickslip.agents.sweeps.telling.chosen import chosen_of
from stickslip.agents.sweeps.telling.pictures import write_pictures
from stickslip.agents.sweeps.telling.regions import along_axes
from stickslip.agents.sweeps.telling.scales import logarithmic
from stickslip.agents.sweeps.telling.views import MOST_POLICIES
from stickslip.agents.sweeps.telling.words import BEST, in_words, measured, summary_table
from stickslip.envs.rendering.html.data import MOST_SAMPLES, Curve, Line, Page, Panel
from stickslip.records.files import write_whole
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from stickslip.agents.sweeps.plan import Plan
    from stickslip.agents.sweeps.reading import SweepArrays
    from stickslip.agents.sweeps.telling.again import Again
    from stickslip.envs.rendering.html.data import Shown

MOST_CURVES = 24
AGAIN = (
    "The episodes were played again from their points and seeds. A program that gives out every "
    "state is another than the sweep's and may round otherwise: the table says what came of it."
)
FIGURES = 6
"""Digits of a number in a table."""


class Products(NamedTuple):
    """What is made of a sweep's data at its end. found: its summaries; text: the same in words.
    files: written, the last one `report`; this is None where there is none."""

    found: SweepArrays
    text: str
    files: tuple[Path, ...]
    report: Path | None


def report_sweep(
    plan: Plan,
    path: Path,
    *,
    pictures: bool = True,
    episodes: bool = True,
    tell: Callable[[str], None] = lambda text: None,
    say: Callable[[str], None] = lambda stage: None,
) -> Products:
    """Write summary.txt, pictures and report.html into a sweep's directory, in place of those that
    are there. Where pictures or page fail, there is a warning.

    pictures: False for summary.txt alone. episodes: whether some are played again to be shown.
    tell: told of the summary in words; say: of what goes on.
    """
    plan = replace(plan, layout=read_about(path).layout)
    found, told = sweep_arrays(path, summaries=True), plan.machine.swept().told
    found = replace(found, drawn=plan.drawn)  # which a directory of before does not say
    text = in_words(found, told)
    tell(text)
    files = [write_whole(path / "summary.txt", text)]
    if not pictures:
        return Products(found, text, tuple(files), None)

    def drawn_and_shown() -> list[Path]:
        say("drawing")
        drawn = write_pictures(found, path, told) if find_spec("matplotlib") else []
        page = write_report(plan, path, found, text, drawn, episodes=episodes, say=say)
        return [*drawn, page]

    more = written_or_told(path, drawn_and_shown)
    return Products(found, text, (*files, *(more or ())), more[-1] if more else None)


def write_report(
    plan: Plan,
    path: Path,
    found: SweepArrays,
    text: str,
    drawn: Sequence[Path] = (),
    *,
    episodes: bool = True,
    say: Callable[[str], None] = lambda stage: None,
) -> Path:
    """Write report.html into a sweep's directory, in place of one that is there; return its path.

    plan: as it was cut. found: its summaries; text: the same in words; drawn: its pictures.
    episodes: whether some are played again to be shown. say: told of what goes on.
    """
    again, said = _played(plan, path, found, say) if episodes else ([], "")
    page = Page(
        title=f"Sweep of the {plan.machine.title}: {path.name}",
        lead=", ".join(dict.fromkeys(shown_name(one.policy) for one in plan.cases))
        + f" on {', '.join(dict.fromkeys(one.task for one in plan.cases))}",
        facts=_facts(plan),
        text=text,
        tables=(
            ("", _summary(plan, found)),
            ("What was varied", _axes_table(plan)),
            *([("The episodes below", _episodes_table(plan, again))] if again else []),
        ),
        episodes=tuple(_shown(plan, one) for one in again),
        curves=tuple(_curves(plan, found)),
        over="All episodes: over each axis the mean over all else",
        pictures=tuple((_caption(one), one.read_bytes()) for one in drawn),
        notes=(said,) if said else (),
    )
    return write_page(page, path / REPORT, overwrite=True)


def _played(
    plan: Plan, path: Path, found: SweepArrays, say: Callable[[str], None]
) -> tuple[list[Again], str]:
    """A few episodes and what is to be said of them, or why there are none."""
    chosen = chosen_of(path, plan, found)
    say(f"playing {len(chosen)} of the episodes again, to be shown")
    try:
        again = play_again(plan, chosen)
    except MemoryError as error:
        return [], f"No episode is shown: memory does not hold one ({error})."
    if not again:
        return [], f"No episode is shown: all may take more than {MOST_STEPS:,} steps."
    return again, AGAIN


def _caption(picture: Path) -> str:
    what = "Failures" if picture.stem.startswith("endings") else "The same over the axes"
    return f"{what} ({picture.name})"


def _facts(plan: Plan) -> tuple[tuple[str, str], ...]:
    rows = "a row a point" if plan.summaries else "a row an episode"
    draws = "apart at every point" if plan.independent else "the same at all points"
    draws = draws if plan.drawn else "none: a reset draws nothing"
    return (
        ("episodes", f"{plan.total:,}"),
        ("points", f"{plan.design.points:,}"),
        ("episodes of a point", str(plan.episodes)),
        ("draws", draws),
        ("written", rows),
    )


def _axes_table(plan: Plan) -> Table:
    heads = [Column("axis", words=True), Column("unit", words=True), Column("values", words=True)]
    heads += [Column("low"), Column("high"), Column("sets", words=True)]
    rows = []
    for name, entry in plan.definition["axes"].items():
        axis = plan.design.axes[name]
        kind = axis.kind if axis.random else f"{len(axis.values)}, {axis.kind}"
        kind += " (in the logarithm)" if axis.random and axis.logarithmic else ""
        low, high = (_figures(one) for one in axis.ends)
        sets, unit = ", ".join(entry.get("sets", [])), plan.units[name]
        rows.append([name, "" if unit == "-" else unit, kind, low, high, sets])
    return Table(heads, rows)


def _episodes_table(plan: Plan, again: Sequence[Again]) -> Table:
    """Which they are, and whether they are what was recorded."""
    heads = [Column(name, words=True) for name in ("episode", "task", "policy")]
    heads += [Column(name, plan.units[name]) for name in plan.design.axes]
    heads += [Column("seed"), Column("return in the sweep"), Column("played again")]
    heads += [Column("the same", words=True)]
    rows = []
    for one in again:
        told = one.chosen.recorded
        row = [one.chosen.why, one.case.task, shown_name(one.case.policy)]
        row += [_figures(value) for value in one.axes.values()]
        row += [one.chosen.seed, "not written" if told is None else _figures(told)]
        rows.append([*row, _figures(one.earned), _sameness(one)])
    return Table(heads, rows)


def _sameness(one: Again) -> str:
    if one.apart is None:
        return "unknown: its point has a summary alone"
    return sameness(one.apart, _same(one))


def _same(one: Again) -> bool:
    return one.apart is None or abs(one.apart) <= one.rounding


def _shown(plan: Plan, one: Again) -> Shown:
    """The episode, or as much of it as an episode of a page may have."""
    length, most = int(one.played.length), MOST_SAMPLES
    cut = one.played._replace(length=min(length, most - 1))
    several = len({case.task for case in plan.cases}) > 1
    name = f"{one.chosen.why}: {shown_name(one.case.policy)}"
    name += f" on {one.case.task}" if several else ""
    shown = plan.machine.shown(cut, one.case.env, one.params, name)
    place = [
        (axis, f"{value:.4g}" + ("" if plan.units[axis] == "-" else f" {plan.units[axis]}"))
        for axis, value in one.axes.items()
    ]
    more = [*place, ("seed", str(one.chosen.seed))]
    if length > most - 1:
        more.append(("shown", f"the first {most - 1} of {length} steps"))
    if not _same(one):
        more.append(("in the sweep", f"return {one.chosen.recorded:.6g}: roundings grew"))
    return replace(shown, facts=(*more, *shown.facts))


def _curves(plan: Plan, found: SweepArrays) -> list[Curve]:
    """What came of it over each axis, the mean over all other axes, a line a policy; of a random
    axis in bins, which the panel says."""
    dims, made = found.dims[2:], []
    policies = [shown_name(str(name)) for name in found.coordinates["policy"][:MOST_POLICIES]]
    several = len(found.coordinates["task"]) > 1
    for at, task in enumerate(found.coordinates["task"]):
        for title, unit, values in measured(found, at, plan.machine.swept().told):
            each = [along_axes(one, dims, found) for one in values[: len(policies)]]
            for axis, (x, *_) in (each[0] if each else {}).items():
                if len(x) < 2:
                    continue
                lines = tuple(
                    Line(name, along[axis][1]) for name, along in zip(policies, each, strict=True)
                )
                head = f"{task}: {title}" if several else title
                if axis not in dims and len(x) < len(found.coordinates[axis]):
                    head += f", means of {len(x)} bins of {axis}"
                made.append(
                    Curve(
                        Column(axis, found.units.get(axis, "-")).title,
                        x,
                        Panel(head, unit, lines),
                        logarithmic(x) or plan.design.axes[axis].logarithmic,
                    )
                )
    return made[:MOST_CURVES]


def _summary(plan: Plan, found: SweepArrays) -> Table:
    """`summary_table` for people: shares in percent."""
    told = plan.machine.swept().told
    table, shares = summary_table(found, told), (told.failures, BEST)
    heads = [
        replace(
            one,
            name=one.name.replace("_", " "),
            unit="%" if one.name in shares else one.unit,
        )
        for one in table.columns
    ]
    percent = [one.name in shares for one in table.columns]
    rows = [
        [_cell(cell, per) for cell, per in zip(row, percent, strict=True)] for row in table.rows
    ]
    return Table(heads, rows)


def _cell(value: object, percent: bool) -> str:
    if isinstance(value, float):
        return f"{100 * value:.3g}" if percent else _figures(value)
    return "" if value is None else shown_name(str(value))


def _figures(value: float) -> str:
    return f"{value:.{FIGURES}g}"
