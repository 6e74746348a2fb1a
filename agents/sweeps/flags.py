"""The flags of `stickslip sweep` and `stickslip compare`; needs neither JAX nor NumPy."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

    from stickslip.agents.machine import AnyMachine

RANDOM = ("sobol", "latin")
"""Kinds of random axes; all axes of a kind are sampled together."""
FORMS = (
    "LOW:HIGH:N (even), LOW:HIGH:N:log, values as 0.1,0.2,0.5, or LOW:HIGH:sobol and "
    "LOW:HIGH:latin, either with :log, for random ones"
)
VALUES = {
    "LOW:HIGH:N": "N values, evenly spaced",
    "LOW:HIGH:N:log": "the same, evenly spaced in the logarithm",
    "A,B,C": "these values",
    "LOW:HIGH:sobol": "random: a coordinate of a Sobol sequence of --samples points",
    "LOW:HIGH:latin": "random: a coordinate of a Latin hypercube; either also with :log",
}


def add_flags(parser: argparse.ArgumentParser, machine: AnyMachine) -> dict[str, Mapping[str, str]]:
    """Add the flags of `sweep` for a machine; return tables for the end of the help."""
    add = parser.add_argument
    add("--policy", nargs="+", required=True, metavar="POLICY",
        help="policy files, directories of training runs and baselines, see below")  # fmt: skip
    add("--axis", action="append", metavar="NAME=VALUES",
        help="a parameter of the task and its values, see below; repeatable")  # fmt: skip
    add("--episodes", type=int, default=32, help="of each point (default: %(default)s)")
    add("--out", metavar="DIR", required=True, help="directory of the sweep")
    add("--samples", type=int, help="points of the random axes")
    add("--resume", action="store_true", help="continue the sweep in --out")
    add("--no-pictures", action="store_true", help="neither sweep.png nor endings.png")
    add("--workers", type=int, metavar="N", help="N processes (default: a thread for each core)")
    add("--scheduler", metavar="ADDRESS", help="the workers of a Dask scheduler")
    group = parser.add_argument_group(f"the task of the {machine.title}")
    default = "(default: the policies' own, or the standard task)"
    group.add_argument(
        "--task", nargs="+", metavar="TASK", help=f"tasks of `stickslip tasks` {default}"
    )
    group.add_argument("--scene", metavar="NAME", help="another floor or ground, see below")
    for option in machine.options():
        option.add_to(group)
    tables: dict[str, Mapping[str, str]] = {
        "values": VALUES,
        f"axes of the {machine.title}": {
            **machine.axes,
            "PART.NAME": "any other number, see docs/sweeps.md",
        },
    }
    if machine.baselines:
        tables["baselines"] = {machine.title: ", ".join(machine.baselines)}
    if machine.scenes:
        names = filter(None, (*machine.scenes, machine.scene_files))
        tables["scenes"] = {machine.title: ", ".join(names)}
    return tables | machine.tables()
