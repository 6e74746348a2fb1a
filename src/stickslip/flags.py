"""Flags of the commands that know policies, tasks, figures and benchmarks by name.

Names and words only: nothing heavy is imported.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from typing import TYPE_CHECKING, Any

from stickslip.agents.machine import AnyMachine, machine_by_name, machines
from stickslip.agents.policy.shipped import shipped_titles
from stickslip.envs.tasks.definition import TASKS
from stickslip.parser import Parser, add_overwrite, flag_of, truth

if TYPE_CHECKING:
    from stickslip.agents.training.configuration import Configuration

AXIS_VALUES = {
    "LOW:HIGH:N": "N values, evenly spaced",
    "LOW:HIGH:N:log": "the same, evenly spaced in the logarithm",
    "A,B,C": "these values",
}
NAMES = "one or more of those below"
POLICY = "a policy of the package, a policy file, a run's directory or a baseline, see below"


def train_flags(parser: Parser, machine: str) -> None:
    """Add the run, and every setting of the machine's configuration."""
    add = parser.add_argument
    add("--out", metavar="DIR", help="directory of the run (default: runs/<machine>-<time>)")
    add("--resume", action="store_true", help="go on with the run in --out")
    add("--no-pictures", action="store_true", help="no plots, no animation")
    about = "settings in TOML, or a run's config.json; those of the command line go before them"
    add("--config", metavar="FILE", help=about)
    kind = machine_by_name(machine).configuration
    add_fields(parser, kind)
    parser.add_parts("changes", kind.PARTS)


def add_fields(parser: Parser, kind: type[Configuration]) -> None:
    """Add a flag or a setting for each field; only those given appear in the parsed arguments."""
    from stickslip.agents.training.configuration import rule_of

    for one in fields(kind):
        rule = rule_of(one)
        options: dict[str, Any] = {"default": argparse.SUPPRESS, "help": _field_help(one, kind)}
        if rule.kind is bool:
            options["type"] = truth
        elif rule.kind == "range":
            options |= {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}
        else:
            options |= {"type": rule.kind, "metavar": rule.kind.__name__.upper()}
        if one.name in kind.FLAGS:
            options["help"] = options["help"].replace("%", "%%")
            parser.add_argument(flag_of(one.name), dest=one.name, **options)
        else:
            parser.add_setting(one.name, **options)


def _field_help(one: Field[object], kind: type[Configuration]) -> str:
    """Meaning of a field, accepted names and defaults."""
    from stickslip.agents.training.configuration import rule_of

    rule = rule_of(one)
    choices = f": {', '.join(rule.choices)}" if rule.choices else ""
    usual = kind.USUALLY.get(one.name, one.default)
    defaults = "none" if usual is None else f"{usual}"
    defaults += ", with a task its own" if one.name in kind.USUALLY else ""
    defaults += f"; sb3: {kind.SB3[one.name]}" if one.name in kind.SB3 else ""
    return f"{rule.about}{choices} (default: {defaults})"


def evaluate_flags(parser: Parser, _: object) -> None:
    """Add policies, task or scene, and episodes."""
    add = parser.add_argument
    _add_policies(parser, nargs="+")
    about = "for each (default: 32; of a task, those it was measured on)"
    add("--episodes", type=int, help=about)
    about = "a task of `stickslip tasks`, in place of the policies' own: with scores and the gap"
    add("--task", metavar="TASK", help=about)
    about = (
        "the biped's motor gives the nearest torque without slip or fall, with this margin (0.02)"
    )
    add("--shield", nargs="?", type=float, const=0.02, metavar="MARGIN", help=about)
    about = "compute the biped's motion in MuJoCo: both feet touch the floor and may lift"
    add("--in", dest="program", choices=("mujoco",), help=about)
    add("--out", metavar="DIR", help="write evaluation.csv and .json there")
    add_overwrite(parser, "what is in --out")
    _add_scene(parser, many=True)


def view_flags(parser: Parser, _: object) -> None:
    """Add policies, task, duration and files."""
    add = parser.add_argument
    _add_policies(parser, nargs="+")
    add("--seed", type=int, default=0, help="of the episode")
    add("--seconds", type=float, default=6.0, help="to show")
    about = ".gif, .png (animated), .webp or .mp4; .html: a page to play, with curves, of up to 8"
    add("--out", metavar="FILE", help=about)
    add_overwrite(parser)
    _add_scene(parser, many=False)


def sweep_flags(parser: Parser, name: str) -> None:
    """Add policies, axes and the machine's task."""
    machine, add = machine_by_name(name), parser.add_argument
    about = "policy files, directories of training runs and baselines, see below"
    add("--policy", nargs="+", required=True, metavar="POLICY", help=about)
    about = "a parameter of the task and its values, see below; repeatable"
    add("--axis", action="append", default=[], metavar="NAME=VALUES", help=about)
    add("--episodes", type=int, default=32, help="of each point")
    add("--out", metavar="DIR", required=True, help="directory of the sweep")
    add("--resume", action="store_true", help="continue the sweep in --out")
    add("--no-pictures", action="store_true", help="no sweep.png")
    group = parser.add_argument_group(f"the task of the {machine.title}")
    about = "tasks of `stickslip tasks` (default: the policies' own, or the standard task)"
    group.add_argument("--task", nargs="+", metavar="TASK", help=about)
    group.add_argument("--scene", metavar="NAME", help="another floor or ground, see below")
    for option, how in machine.options.items():
        group.add_argument(flag_of(option), **how)
    parser.add_parts("changes", machine.configuration.PARTS)
    axes = {**machine.axes, "PART.NAME": "any other number, see docs/sweeps.md"}
    parser.tables = {"values": AXIS_VALUES, f"axes of the {machine.title}": axes}
    parser.tables |= _names_of([machine])


def _names_of(every: Sequence[AnyMachine]) -> dict[str, Mapping[str, str]]:
    """Tables of the machines' baselines, scenes and what else they name."""
    baselines = {one.title: ", ".join(one.baselines) for one in every if one.baselines}
    scenes = {
        one.title: ", ".join(filter(None, (*one.scenes, one.scene_files)))
        for one in every
        if one.scenes
    }
    found = {"baselines": baselines, "scenes": scenes}
    tables: dict[str, Mapping[str, str]] = {name: one for name, one in found.items() if one}
    for machine in every:
        tables |= machine.tables
    return tables


def tasks_flags(parser: Parser, _: object) -> None:
    """Add the tasks' names."""
    parser.tables = {"tasks": {name: task.title for name, task in TASKS.items()}}
    parser.add_argument("names", nargs="*", metavar="NAME", help=NAMES)


def policies_flags(parser: Parser, _: object) -> None:
    """Add the policies' names."""
    parser.tables = {"policies": shipped_titles()}
    parser.add_argument("names", nargs="*", metavar="NAME", help=NAMES)


def export_flags(parser: Parser, _: object) -> None:
    """Add the policy or the machine, and the files."""
    add = parser.add_argument
    _add_policies(parser, "one of those below, a file, a run, or a robot's file in TOML")
    add("--out", metavar="FILE", help="a policy as .onnx, or .npz for NumPy alone")
    add("--mjcf", metavar="FILE", help="a robot for MuJoCo: closed loops, floor, motor, two feet")
    add("--urdf", metavar="FILE", help="a robot as URDF: a tree, whose loops are cut")
    about = "friction of the floor for MuJoCo, static and kinetic (default: 0.5)"
    add("--mu", type=float, help=about)
    add_overwrite(parser)
    parser.add_parts("changes", ("robot", "bars", "motor"))
    parser.tables = {"policies": shipped_titles()}


def reproduce_flags(parser: Parser, _: object) -> None:
    """Add the figures' names, files and resolution."""
    from stickslip.paper.figure import EVERYTHING, FIGURES

    add = parser.add_argument
    about = f"one or more of those below, or {EVERYTHING}"
    add("figures", nargs="+", metavar="FIGURE", help=about)
    about = "where files go"
    add("--out", metavar="DIR", default="figures", help=about)
    add_overwrite(parser, "files in --out")
    about = "points a step; of fig24 along the bump"
    add("--samples", type=int, default=240, metavar="N", help=about)
    for name in ("robot", "vehicle"):
        add(f"--{name}", metavar="FILE", help=f"a {name} of one's own, for its figures")
    parser.add_parts("changes", ("robot", "bars", "vehicle"))
    parser.tables = {"figures": {name: one.title for name, one in FIGURES.items()}}


def _add_policies(parser: Parser, about: str = POLICY, nargs: str | None = None) -> None:
    parser.add_argument("who", metavar="POLICY", nargs=nargs, help=about)


def _add_scene(parser: Parser, many: bool) -> None:
    """Add the scene and changes of the task, machine by machine."""
    every = machines()
    usual = [(not many and one.viewed_scene) or one.scenes[0] for one in every if one.scenes]
    about = f"(default: the policy's own; for baselines alone {' or '.join(usual)})"
    parser.add_argument(
        "--scene",
        dest="scenes",
        metavar="NAME,..." if many else "NAME",
        type=lambda text: text.split(",") if many else [text],
        help=f"floor or ground, see below {about}",
    )
    parts = [part for machine in every for part in machine.configuration.PARTS]
    parser.add_parts("changes", parts)
    parser.numbers = "numbers"
    for machine in every:
        under = parser.add_argument_group(f"for the {machine.title}")
        for option, how in machine.options.items():
            if flag_of(option) not in parser._option_string_actions:
                under.add_argument(flag_of(option), **how)
    numbers = {f"numbers of the {one.title}, as --set NAME=VALUE": one.axes for one in every}
    parser.tables = _names_of(every) | {of: one for of, one in numbers.items() if one}
    parser.tables |= {"policies": shipped_titles()}


def robot_flags(parser: Parser, _: object) -> None:
    """Add the machine's file and what is told of it."""
    add = parser.add_argument
    add("file", metavar="FILE", help="a robot's or a vehicle's file in TOML")
    add("--new", action="store_true", help="write a template to FILE, no more")
    add("--machine", choices=("biped", "ugv"), default="biped", help="of the template")
    about = "frictions to find the fastest motion for (default: 0.1 0.3 0.6)"
    add("--mu", nargs="+", type=float, default=[0.1, 0.3, 0.6], help=about)
    add("--out", metavar="PNG", help="the picture (default: FILE with .png)")
    add_overwrite(parser, "the picture")
    parser.add_parts("changes", ("robot", "bars", "vehicle", "motor"))
