"""The flags of `stickslip sweep` and `stickslip compare`; needs neither JAX nor NumPy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.sweeps.names import IN_WORDS

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

    from stickslip.agents.machine import AnyMachine


def add_flags(parser: argparse.ArgumentParser, machine: AnyMachine) -> dict[str, Mapping[str, str]]:
    """Add those of `sweep` for a machine; return tables for the end of the help."""
    parser.add_argument(
        "--policy",
        nargs="+",
        required=True,
        metavar="POLICY",
        help="policy files, runs' directories and baselines, see below",
    )
    parser.add_argument(
        "--axis",
        action="append",
        metavar="NAME=VALUES",
        help="a number of the task and its values, see below; may come again",
    )
    parser.add_argument("--episodes", type=int, default=32, help="of each point (default: 32)")
    parser.add_argument("--out", metavar="DIR", required=True, help="directory of the sweep")
    parser.add_argument("--samples", type=int, help="points of the random axes")
    parser.add_argument(
        "--design-seed", type=int, default=0, help="of the random axes (default: %(default)s)"
    )
    parser.add_argument(
        "--independent",
        action="store_true",
        help="draw apart at every point (default: the same draws at all, as evaluate does)",
    )
    parser.add_argument(
        "--summaries", action="store_true", help="write a row a point, not a row an episode"
    )
    parser.add_argument("--resume", action="store_true", help="go on with the sweep in --out")
    parser.add_argument("--overwrite", action="store_true", help="begin the sweep in --out anew")
    parser.add_argument(
        "--no-pictures", action="store_true", help="no sweep.png, no endings.png, no report.html"
    )
    parser.add_argument(
        "--no-episodes", action="store_true", help="play none again to be shown in report.html"
    )
    how = parser.add_argument_group("how it is played (no result depends on it)")
    how.add_argument("--chunk", type=int, metavar="N", help="episodes of a chunk")
    how.add_argument("--cores", type=int, metavar="N", help="chunks at once (default: all cores)")
    how.add_argument("--workers", type=int, metavar="N", help="N processes of this machine instead")
    how.add_argument("--scheduler", metavar="ADDRESS", help="those of a Dask scheduler")
    _add_task(parser, machine)
    tables: dict[str, Mapping[str, str]] = {
        "values": IN_WORDS,
        f"axes of the {machine.title}": {
            **machine.axes,
            "PART.NAME": "any other number, see docs/sweeps.md",
        },
    }
    if machine.baselines:
        tables["baselines"] = {machine.title: ", ".join(machine.baselines)}
    if machine.scenes:
        tables["scenes"] = {
            machine.title: ", ".join(filter(None, (*machine.scenes, machine.scene_files)))
        }
    return tables | machine.tables()


def add_compare_flags(parser: argparse.ArgumentParser) -> None:
    """Add those of `compare`."""
    parser.add_argument("one", metavar="DIR", help="a sweep's directory")
    parser.add_argument("other", metavar="DIR", help="another, of the same machine")
    parser.add_argument("--out", metavar="FILE", help="also write every common point as .csv")
    parser.add_argument("--overwrite", action="store_true", help="replace the file")


def _add_task(parser: argparse.ArgumentParser, machine: AnyMachine) -> None:
    """On which task: of the ladder, or the policies' own with changes."""
    under = parser.add_argument_group(f"the task of the {machine.title}")
    under.add_argument(
        "--task",
        nargs="+",
        metavar="TASK",
        help="tasks of `stickslip tasks` (default: the policies' own, or the standard task)",
    )
    under.add_argument("--scene", metavar="NAME", help="floor or ground instead, see below")
    for option in machine.options():
        option.add_to(under)
