"""`stickslip bench optimisers`: races, reports, methods. Help needs no JAX."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.optimisers.methods import METHODS, methods_table
from stickslip.parser import Parser, add_options, examples_text, option, options_of
from stickslip.records.files import require_folder, write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

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
ABOUT = {
    "run": "run methods on instances into a directory",
    "report": "compare runs: tables, ECDF plots",
    "methods": "list the methods",
}


@dataclass(frozen=True)
class RaceOptions:
    """Options of a race, see agents.optimisers.racing.race."""

    out: str = option(about="directory of the race")
    methods: list[str] | None = option(None, "names (default: all)")
    instances: list[str] | None = option(None, "ids of the suite (default: all)")
    budget: int | None = option(None, "values and gradients of a run")
    seconds: float | None = option(None, "processor time of a run")
    seeds: int = option(3, "of each method on each instance")
    limit: float = option(120.0, "time on the clock, after which a run is killed [s]")
    resume: bool = option(False, "continue the race in --out")
    workers: int | None = option(None, "processes (default: cores)")


def bench_command(flags: Mapping[str, Any]) -> Content:
    """Run what stands behind the name. --json may stand there, too."""
    return run([one for one in flags["rest"] if one != "--json"])


def run(arguments: list[str]) -> Content:
    """Run a command. ValueError or OSError for wrong input."""
    given = vars(make_parser().parse_args(arguments))
    return {"run": _run, "report": _report, "methods": _methods}[given["part"]](given)


def make_parser() -> Parser:
    """The flags."""
    every = {line: about for of_part in EXAMPLES.values() for line, about in of_part.items()}
    about = "Optimisers on the suite of instances: run them, compare them."
    parser = Parser(prog=PROGRAM, description=f"{about}\n\n{examples_text(every)}")
    parts = parser.add_subparsers(required=True, metavar=" | ".join(EXAMPLES), dest="part")
    for name, examples in EXAMPLES.items():
        part = parts.add_parser(name, prog=f"{PROGRAM} {name}", help=ABOUT[name])
        part.description = f"{ABOUT[name]}\n\n{examples_text(examples)}"
        if name == "run":
            add_options(part, RaceOptions)
        elif name == "report":
            part.add_argument("source", nargs="+", help="directories of races, tables of others")
            part.add_argument("--out", required=True, metavar="DIR", help="a new directory")
    return parser


def _run(flags: Mapping[str, Any]) -> Content:
    from stickslip.agents.optimisers.racing import race
    from stickslip.agents.optimisers.report import counted_text, runs_table
    from stickslip.agents.sweeps.cells import StoppedError
    from stickslip.optim import suite

    given = asdict(options_of(RaceOptions, flags))
    require_folder(given["out"])
    methods, names = given.pop("methods") or list(METHODS), given.pop("instances") or list(suite())
    given["out"] = Path(given["out"])
    with stoppable() as stop:
        try:
            runs = race(methods, names, **given, progress=True, stop=stop)
        except StoppedError:
            message = f"Stopped; go on with the same command and --resume ({given['out']})"
            raise stop.interrupted(message) from None
    print(counted_text(runs), end="")
    print(f"Compare them: {PROGRAM} report {given['out']} --out DIR")
    return Content({"runs": runs_table(runs)}, {"directory": str(given["out"])})


def _report(flags: Mapping[str, Any]) -> Content:
    from stickslip.agents.optimisers.report import draw_ecdfs, report_text, runs_table
    from stickslip.agents.optimisers.runs import read_results, write_results

    out = Path(flags["out"])
    require_folder(out)
    if out.exists():
        raise ValueError(f"{out} exists; accepted: a new directory")
    runs = read_results(*map(Path, flags["source"]))
    text = report_text(runs)
    print(text)
    written = [write_whole(out / "report.md", text, overwrite=False)]
    written += [write_results(runs, out / f"results.{kind}") for kind in ("parquet", "csv")]
    written += draw_ecdfs(runs, out)
    print("Written: " + ", ".join(map(str, written)))
    return Content({"runs": runs_table(runs)}, {"written": [str(one) for one in written]})


def _methods(_: Mapping[str, Any]) -> Content:
    table = methods_table()
    print(table.terminal())
    return Content({"methods": table})
