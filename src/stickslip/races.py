"""`stickslip bench optimisers`: races, reports, methods. Help needs no JAX."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.optimisers.methods import METHODS, methods_table
from stickslip.parser import Parser, examples_text

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from stickslip.records.table import Content

PROGRAM = "stickslip bench optimisers"
EXAMPLES = {
    "run": {
        f"{PROGRAM} run --instances shoot-grip-d10-v1 --methods cma slsqp random --budget 500 "
        "--seeds 3 --out runs/race": "three methods on an instance",
        f"{PROGRAM} run --budget 500 --out runs/race --resume": "go on with a race",
    },
    "report": {f"{PROGRAM} report runs/race theirs.csv --out runs/report": "with runs of others"},
    "methods": {f"{PROGRAM} methods": "names for --methods"},
}


def run(arguments: list[str]) -> Content:
    """Run a command. ValueError or OSError for wrong input."""
    given = make_parser().parse_args(arguments)
    return given.run(given)


def make_parser() -> Parser:
    """The flags."""
    every = {line: about for of_part in EXAMPLES.values() for line, about in of_part.items()}
    about = "Optimisers on the suite of instances: run them, compare them."
    parser = Parser(prog=PROGRAM, description=f"{about}\n\n{examples_text(every)}")
    parts = parser.add_subparsers(required=True, metavar=" | ".join(EXAMPLES))

    def part(name: str, about: str, run: Callable[[argparse.Namespace], Content]) -> Parser:
        described = f"{about}\n\n{examples_text(EXAMPLES[name])}"
        made = parts.add_parser(name, prog=f"{PROGRAM} {name}", help=about, description=described)
        made.set_defaults(run=run)
        return made

    _add_run(part("run", "run methods on instances into a directory", _run).add_argument)
    add = part("report", "compare runs: tables, ECDF plots", _report).add_argument
    add("source", nargs="+", type=Path, help="directories of races, tables of others")
    add("--out", type=Path, required=True, metavar="DIR", help="a new directory")
    part("methods", "list the methods", _methods)
    return parser


def _add_run(add: Callable[..., object]) -> None:
    add("--out", type=Path, required=True, metavar="DIR", help="directory of the race")
    add("--methods", nargs="+", metavar="NAME", default=list(METHODS), help="(default: all)")
    add("--instances", nargs="+", metavar="ID", help="ids of the suite (default: all)")
    add("--budget", type=int, metavar="N", help="values and gradients of a run")
    add("--seconds", type=float, metavar="S", help="processor time of a run")
    add("--seeds", type=int, default=3, metavar="N", help="(default: %(default)s)")
    add("--limit", type=float, default=120.0, metavar="S",
        help="time on the clock, after which a run is killed (default: %(default)g)")  # fmt: skip
    add("--resume", action="store_true", help="continue the race in --out")
    add("--workers", type=int, metavar="N", help="processes (default: cores)")


def _run(given: argparse.Namespace) -> Content:
    from stickslip.agents.optimisers.racing import race
    from stickslip.agents.optimisers.report import counted_text, runs_table
    from stickslip.agents.sweeps.cells import StoppedError
    from stickslip.optim import suite
    from stickslip.records.files import require_folder
    from stickslip.records.signals import stoppable
    from stickslip.records.table import Content

    require_folder(given.out)
    names = list(suite()) if given.instances is None else given.instances
    options = ("budget", "seconds", "seeds", "limit", "out", "resume", "workers")
    flags = {one: getattr(given, one) for one in options}
    with stoppable() as stop:
        try:
            runs = race(given.methods, names, **flags, progress=True, stop=stop)
        except StoppedError:
            message = f"Stopped; go on with the same command and --resume ({given.out})"
            raise stop.interrupted(message) from None
    print(counted_text(runs), end="")
    print(f"Compare them: {PROGRAM} report {given.out} --out DIR")
    return Content({"runs": runs_table(runs)}, {"directory": str(given.out)})


def _report(given: argparse.Namespace) -> Content:
    from stickslip.agents.optimisers.report import draw_ecdfs, report_text, runs_table
    from stickslip.agents.optimisers.runs import read_results, write_results
    from stickslip.records.files import require_folder, write_whole
    from stickslip.records.table import Content

    require_folder(given.out)
    if given.out.exists():
        raise ValueError(f"{given.out} exists; accepted: a new directory")
    runs = read_results(*given.source)
    text = report_text(runs)
    print(text)
    written = [write_whole(given.out / "report.md", text, overwrite=False)]
    written += [write_results(runs, given.out / f"results.{kind}") for kind in ("parquet", "csv")]
    written += draw_ecdfs(runs, given.out)
    print("Written: " + ", ".join(map(str, written)))
    return Content({"runs": runs_table(runs)}, {"written": [str(one) for one in written]})


def _methods(given: argparse.Namespace) -> Content:
    from stickslip.records.table import Content

    table = methods_table()
    print(table.terminal())
    return Content({"methods": table})
