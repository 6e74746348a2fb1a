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
from stickslip.parser import Parser, flag_of, truth

if TYPE_CHECKING:
    from stickslip.agents.training.configuration import Configuration
    from stickslip.agents.untrusted import Rule

AXIS_VALUES = {
    "LOW:HIGH:N": "N values, evenly spaced",
    "LOW:HIGH:N:log": "the same, evenly spaced in the logarithm",
    "A,B,C": "these values",
}
NAMES = "one or more of those below"
POLICY = "a policy of the package, a policy file, a run's directory or a baseline, see below"


def train_flags(parser: Parser, machine: str) -> None:
    """Add the run, and every setting of the machine's configuration."""
    add = parser.add
    add("--out DIR", "directory of the run (default: runs/<machine>-<time>)")
    add("--resume", "go on with the run in --out", action="store_true")
    add("--no-pictures", "no plots, no animation", action="store_true")
    about = "settings in TOML, or a run's config.json; those of the command line go before them"
    add("--config FILE", about)
    kind = machine_by_name(machine).configuration
    add_fields(parser, kind)
    parser.add_parts("changes", kind.PARTS)


def add_fields(parser: Parser, kind: type[Configuration]) -> None:
    """Add a flag or a setting for each field; only those given appear in the parsed arguments."""
    from stickslip.agents.training.configuration import rule_of

    for one in fields(kind):
        rule = rule_of(one)
        about, options = _about(one, rule, kind), dict[str, Any](default=argparse.SUPPRESS)
        if rule.kind is bool:
            options["type"] = truth
        elif rule.kind == "range":
            options |= {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}
        else:
            options |= {"type": rule.kind, "metavar": rule.kind.__name__.upper()}
        if one.name in kind.FLAGS:
            parser.add(flag_of(one.name), about.replace("%", "%%"), dest=one.name, **options)
        else:
            parser.put(one.name, about, **options)


def _about(one: Field[object], rule: Rule, kind: type[Configuration]) -> str:
    """Meaning of a field, accepted names and defaults."""
    choices = f": {', '.join(rule.choices)}" if rule.choices else ""
    usual = kind.USUALLY.get(one.name, one.default)
    defaults = "none" if usual is None else f"{usual}"
    defaults += ", with a task its own" if one.name in kind.USUALLY else ""
    defaults += f"; sb3: {kind.SB3[one.name]}" if one.name in kind.SB3 else ""
    return f"{rule.about}{choices} (default: {defaults})"


def evaluate_flags(parser: Parser, _: object) -> None:
    """Add policies, task or scene, and episodes."""
    add = parser.add
    add("who POLICY", POLICY, nargs="+")
    add("--episodes", "for each (default: 32; of a task, those it was measured on)", type=int)
    about = "a task of `stickslip tasks`, in place of the policies' own: with scores and the gap"
    add("--task TASK", about)
    about = (
        "the biped's motor gives the nearest torque without slip or fall, with this margin (0.02)"
    )
    add("--shield MARGIN", about, nargs="?", type=float, const=0.02)
    about = "compute the biped's motion in MuJoCo: both feet touch the floor and may lift"
    add("--in", about, dest="program", choices=("mujoco",))
    add("--out DIR", "write evaluation.csv and .json there")
    add("--overwrite", "replace what is in --out", action="store_true")
    _add_scene(parser, many=True)


def view_flags(parser: Parser, _: object) -> None:
    """Add policies, task, duration and files."""
    add = parser.add
    add("who POLICY", POLICY, nargs="+")
    add("--seed", "of the episode", type=int, default=0)
    add("--seconds", "to show", type=float, default=6.0)
    about = ".gif, .png (animated), .webp or .mp4; .html: a page to play, with curves, of up to 8"
    add("--out FILE", about)
    add("--overwrite", "replace the files", action="store_true")
    _add_scene(parser, many=False)


def sweep_flags(parser: Parser, name: str) -> None:
    """Add policies, axes and the machine's task."""
    machine, add = machine_by_name(name), parser.add
    about = "policy files, directories of training runs and baselines, see below"
    add("--policy POLICY", about, nargs="+", required=True)
    about = "a parameter of the task and its values, see below; repeatable"
    add("--axis NAME=VALUES", about, action="append", default=[])
    add("--episodes", "of each point", type=int, default=32)
    add("--out DIR", "directory of the sweep", required=True)
    add("--resume", "continue the sweep in --out", action="store_true")
    add("--no-pictures", "no sweep.png", action="store_true")
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
    named = {one.title: (*one.scenes, one.scene_files) for one in every if one.scenes}
    scenes = {title: ", ".join(filter(None, names)) for title, names in named.items()}
    found = {"baselines": baselines, "scenes": scenes}
    tables: dict[str, Mapping[str, str]] = {name: one for name, one in found.items() if one}
    for machine in every:
        tables |= machine.tables
    return tables


def tasks_flags(parser: Parser, _: object) -> None:
    """Add the tasks' names."""
    parser.tables = {"tasks": {name: task.title for name, task in TASKS.items()}}
    parser.add("names NAME", NAMES, nargs="*")


def policies_flags(parser: Parser, _: object) -> None:
    """Add the policies' names."""
    parser.tables = {"policies": shipped_titles()}
    parser.add("names NAME", NAMES, nargs="*")


def export_flags(parser: Parser, _: object) -> None:
    """Add the policy or the machine, and the files."""
    add = parser.add
    add("who POLICY", "one of those below, a file, a run, or a robot's file in TOML")
    add("--out FILE", "a policy as .onnx, or .npz for NumPy alone")
    add("--mjcf FILE", "a robot for MuJoCo: closed loops, floor, motor, two feet")
    add("--urdf FILE", "a robot as URDF: a tree, whose loops are cut")
    add("--mu", "friction of the floor for MuJoCo, static and kinetic (default: 0.5)", type=float)
    add("--overwrite", "replace the files", action="store_true")
    parser.add_parts("changes", ("robot", "bars", "motor"))
    parser.tables = {"policies": shipped_titles()}


def reproduce_flags(parser: Parser, _: object) -> None:
    """Add the figures' names, files and resolution."""
    from stickslip.paper.figure import EVERYTHING, FIGURES

    add = parser.add
    add("figures FIGURE", f"one or more of those below, or {EVERYTHING}", nargs="+")
    add("--out DIR", "where files go", default="figures")
    add("--overwrite", "replace files in --out", action="store_true")
    add("--samples N", "points a step; of fig24 along the bump", type=int, default=240)
    for name in ("robot", "vehicle"):
        add(f"--{name} FILE", f"a {name} of one's own, for its figures")
    parser.add_parts("changes", ("robot", "bars", "vehicle"))
    parser.tables = {"figures": {name: one.title for name, one in FIGURES.items()}}


def _add_scene(parser: Parser, many: bool) -> None:
    """Add the scene and changes of the task, machine by machine."""
    every = machines()
    usual = [(not many and one.viewed_scene) or one.scenes[0] for one in every if one.scenes]
    about = f"(default: the policy's own; for baselines alone {' or '.join(usual)})"
    parser.add(
        f"--scene NAME{',...' if many else ''}",
        f"floor or ground, see below {about}",
        dest="scenes",
        type=lambda text: text.split(",") if many else [text],
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
    add = parser.add
    add("file FILE", "a robot's or a vehicle's file in TOML")
    add("--new", "write a template to FILE, no more", action="store_true")
    add("--machine", "of the template", choices=("biped", "ugv"), default="biped")
    about = "frictions to find the fastest motion for (default: 0.1 0.3 0.6)"
    add("--mu", about, nargs="+", type=float, default=[0.1, 0.3, 0.6])
    add("--out PNG", "the picture (default: FILE with .png)")
    add("--overwrite", "replace the picture", action="store_true")
    parser.add_parts("changes", ("robot", "bars", "vehicle", "motor"))
