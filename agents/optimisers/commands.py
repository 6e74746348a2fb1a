"""What `stickslip bench optimisers` does: races, reports, exports. Help needs no JAX."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.optimisers.method import METHODS
from stickslip.optim.progress import say_stage
from stickslip.records.signals import Interrupted, complain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.optimisers.results import Run
    from stickslip.records.content import Content

OK, WRONG_INPUT = 0, 2
PROGRAM = "stickslip bench optimisers"
EXAMPLES = {
    "run": f"""\
  {PROGRAM} run --instances shoot-grip-d10-v1 --methods cma slsqp random \\
      --budget 500 --seeds 3 --out runs/race
  {PROGRAM} run ... --out runs/race --resume
""",
    "report": f"  {PROGRAM} report runs/race --with theirs.csv --out runs/report\n",
    "export": f"  {PROGRAM} export runs/race --ioh runs/ioh\n",
    "methods": f"  {PROGRAM} methods\n",
}
"""By part."""


def main(arguments: list[str]) -> int:
    """Do what is asked; the exit status: 0, 2 for wrong input, 128 + a signal's number."""
    return run(arguments)[0]


def run(arguments: list[str]) -> tuple[int, Content | None]:
    """The same; the exit status, and what was found."""
    given = make_parser().parse_args(arguments)
    try:
        found = given.run(given)
    except (ValueError, OSError, ModuleNotFoundError) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return WRONG_INPUT, None
    except Interrupted as error:
        complain(str(error))
        return error.status, None
    return OK, found


def make_parser(program: str = PROGRAM) -> argparse.ArgumentParser:
    """Its flags."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog=program,
        description="Optimisers on the suite of instances: run them, compare them.",
        epilog="examples:\n" + "".join(EXAMPLES.values()),
        formatter_class=raw,
    )
    parts = parser.add_subparsers(required=True, metavar=" | ".join(EXAMPLES))

    def part(name: str, about: str) -> argparse.ArgumentParser:
        example = f"examples:\n{EXAMPLES[name]}"
        return parts.add_parser(name, help=about, epilog=example, formatter_class=raw)

    add_run(part("run", "run methods on instances into a directory"))
    report = part("report", "compare runs, in words and pictures")
    _add_sources(report)
    report.add_argument("--out", type=Path, required=True, metavar="DIR", help="a new directory")
    report.set_defaults(run=_report)
    export = part("export", "write runs as one table, or for IOHanalyzer")
    _add_sources(export)
    export.add_argument("--table", type=Path, metavar="FILE", help="a new .parquet or .csv")
    export.add_argument("--ioh", type=Path, metavar="DIR", help="a new folder of IOHprofiler's")
    export.set_defaults(run=_export)
    part("methods", "list the methods").set_defaults(run=_methods)
    return parser


def add_run(parser: argparse.ArgumentParser) -> None:
    """The flags of a race."""
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory of it")
    parser.add_argument(
        "--methods", nargs="+", metavar="NAME", default=list(METHODS), help="(default: all)"
    )
    parser.add_argument(
        "--instances", nargs="+", metavar="ID", help="ids of the suite (default: all)"
    )
    parser.add_argument("--budget", type=int, metavar="N", help="values and gradients of a run")
    parser.add_argument("--seconds", type=float, metavar="S", help="processor time of a run")
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="(default: %(default)s)")
    parser.add_argument(
        "--outside", choices=("clip", "refuse"), default="clip", help="points out of bounds"
    )
    parser.add_argument(
        "--limit", type=float, default=120.0, metavar="S",
        help="on the clock, after which a run is killed (default: %(default)g)",
    )  # fmt: skip
    parser.add_argument("--resume", action="store_true", help="go on with the race in --out")
    parser.add_argument(
        "--again", action="store_true", help="with --resume: the runs that failed, too"
    )
    parser.add_argument("--workers", type=int, metavar="N", help="processes (default: cores)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, whose workers do it")
    parser.add_argument("--no-pictures", action="store_true", help="no report.html")
    parser.set_defaults(run=_run)


def _add_sources(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("source", nargs="+", type=Path, help="races' directories, tables")
    parser.add_argument(
        "--with", nargs="+", type=Path, default=[], dest="others", metavar="FILE",
        help="tables of others",
    )  # fmt: skip


def _run(given: argparse.Namespace) -> Content:
    from stickslip.agents.optimisers.plan import RacePlan
    from stickslip.agents.optimisers.racing import run_race
    from stickslip.agents.optimisers.words import counted_text, runs_table
    from stickslip.agents.sweeps.playing.play import StoppedError
    from stickslip.agents.view_files import require_folder
    from stickslip.optim.instances.catalogue import suite
    from stickslip.records.content import Content
    from stickslip.records.signals import stoppable

    require_folder(given.out)
    if given.again and not given.resume:
        raise ValueError("--again without --resume; accepted: with it")
    plan = RacePlan.of(
        given.methods,
        list(suite()) if given.instances is None else given.instances,
        budget=given.budget,
        seconds=given.seconds,
        seeds=given.seeds,
        outside=given.outside,
        limit=given.limit,
    )
    print(
        f"{len(plan.tasks)} runs into {given.out}; {len(plan.left_out)} pairs of method and "
        "instance do not suit each other",
        flush=True,
    )
    with stoppable() as stop:
        try:
            runs = run_race(
                plan,
                given.out,
                resume=given.resume,
                again=given.again,
                workers=given.workers,
                scheduler=given.scheduler,
                progress=True,
                stop=stop,
            )
        except StoppedError:
            again = f"Stopped; go on with the same command and --resume ({given.out})"
            raise stop.interrupted(again) from None
    print(counted_text(runs), end="")
    if not given.no_pictures:
        from stickslip.agents.reports.raced import report_race

        if (page := report_race(runs, given.out, say_stage)) is not None:
            print(f"Written: {page}")
    print(f"Compare them: {PROGRAM} report {given.out} --out DIR")
    return Content({"runs": runs_table(runs)}, {"directory": str(given.out)})


def _read(given: argparse.Namespace) -> list[Run]:
    from stickslip.agents.optimisers.reading import read_results

    return read_results(*given.source, *given.others)


def _report(given: argparse.Namespace) -> Content:
    from stickslip.agents.optimisers.pictures import draw_report
    from stickslip.agents.optimisers.results import write_results
    from stickslip.agents.optimisers.words import report_text, runs_table
    from stickslip.agents.reports.raced import write_race
    from stickslip.agents.view_files import require_folder
    from stickslip.records.content import Content
    from stickslip.records.files import write_whole

    require_folder(given.out)
    if given.out.exists():
        raise ValueError(f"{given.out} exists; accepted: a new directory")
    runs = _read(given)
    text = report_text(runs)
    print(text)
    say_stage("drawing")
    written = [write_whole(given.out / "report.md", text, overwrite=False)]
    written += [write_results(runs, given.out / f"results.{kind}") for kind in ("parquet", "csv")]
    drawn = draw_report(runs, given.out)
    written += [*drawn, write_race(runs, given.out, drawn, say=say_stage)]
    print("Written: " + ", ".join(map(str, written)))
    return Content({"runs": runs_table(runs)}, {"written": [str(one) for one in written]})


def _export(given: argparse.Namespace) -> Content:
    from stickslip.agents.optimisers.ioh import write_ioh
    from stickslip.agents.optimisers.results import write_results
    from stickslip.agents.optimisers.words import runs_table
    from stickslip.records.content import Content

    if given.table is None and given.ioh is None:
        raise ValueError("neither --table nor --ioh; accepted: one of them, or both")
    runs, written = _read(given), []
    if given.table is not None:
        written.append(write_results(runs, given.table))
    if given.ioh is not None:
        written += write_ioh(runs, given.ioh)
    print("Written: " + ", ".join(map(str, written)))
    return Content({"runs": runs_table(runs)}, {"written": [str(one) for one in written]})


def _methods(given: argparse.Namespace) -> Content:
    from stickslip.agents.optimisers.words import methods_table
    from stickslip.records.content import Content

    table = methods_table()
    print(table.terminal())
    return Content({"methods": table})


def command(arguments: Sequence[str] | None = None) -> None:
    """`python -m stickslip.agents.optimisers.commands`."""
    sys.exit(main(list(sys.argv[1:] if arguments is None else arguments)))


if __name__ == "__main__":
    command()
