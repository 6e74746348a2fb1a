"""Flags and settings of every command: names and words only, nothing heavy is imported."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from typing import Any

from stickslip.agents.machine import Machine, machine_by_name, machines
from stickslip.agents.policy.shipped import shipped_titles
from stickslip.agents.training.configuration import Configuration
from stickslip.agents.untrusted import Rule
from stickslip.dynamics.names import SCENES, TRACKS, UNKNOWNS
from stickslip.envs.tasks.definition import TASKS
from stickslip.optim.gait import METHODS as GAIT_METHODS
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.posture import CRITERIA_IN_WORDS, METHODS, TREATMENTS
from stickslip.parser import Parser, flag_of, limit, truth

AXIS_VALUES = {
    "LOW:HIGH:N": "N values, evenly spaced",
    "LOW:HIGH:N:log": "the same, evenly spaced in the logarithm",
    "A,B,C": "these values",
}
POLICY = "a policy of the package, a policy file, a run's directory or a baseline, see below"
TRACK_OPTIONS = {
    "flat": ("start=0.0", "end=8.0"),
    "incline": ("slope=0.3", "start=0.0", "end=8.0"),
    "bump": ("height=0.1", "centre=4.0", "width=1.0", "start=0.0", "end=8.0"),
    "sinusoid": ("amplitude=0.05", "wavelength=2.0", "start=0.0", "end=8.0"),
    "ramp": ("slope=0.3", "position=2.0", "length=4.0", "joint=1.0", "start=0.0", "end=8.0"),
    "step": ("height=0.1", "position=4.0", "length=0.5", "start=0.0", "end=8.0"),
    "ditch": ("depth=0.1", "position=4.0", "width=1.0", "side=0.5", "start=0.0", "end=8.0"),
    "rough": ("key=0", "iso_class=C", "start=0.0", "end=20.0", "margin=2.0"),
}
"""Arguments of each named track's constructor, with their defaults."""
SETTINGS = {
    "fast": "a table and steps of 5 ms in single precision",
    "balanced": "a table and steps of 2.5 ms in single precision",
    "exact": "every switch located by an adaptive method in double precision",
}
"""The presets of stickslip.dynamics.PRESETS."""
TORQUE_NAMES = {
    "t": "time [s]",
    "phase": "crank angle of the supporting leg, pi/2 to 3 pi/2 [rad]",
    "crank_angle": "the same without wrapping [rad]",
    "crank_rate": "[rad/s]",
    "foot_position, foot_velocity": "of the foot over the floor, forwards [m], [m/s]",
    "steps": "exchanges of support so far",
}


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
    parser.add_parts(kind.PARTS)


def add_fields(parser: Parser, kind: type[Configuration]) -> None:
    """Add a flag or a setting for each field; only those given appear in the parsed arguments."""
    for one in fields(kind):
        rule: Rule = one.metadata["rule"]
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
    sb3 = one.metadata.get("sb3")
    usual = kind.USUALLY.get(one.name, one.default)
    defaults = "none" if usual is None else f"{usual}"
    defaults += ", with a task its own" if one.name in kind.USUALLY else ""
    defaults += f"; sb3: {sb3}" if sb3 is not None else ""
    return f"{rule.about}{choices} (default: {defaults})"


def evaluate_flags(parser: Parser, _: object) -> None:
    """Add policies, task or scene, and episodes."""
    add = parser.add
    add("who POLICY", POLICY, nargs="+")
    add("--episodes", "for each (default: 32; of a task, those it was measured on)", type=int)
    about = (
        "a task of `stickslip tasks`, in place of the policies' own: with scores and the gap; all: "
        "rank methods, each a directory of runs, a policy, a baseline or a results file"
    )
    add("--task TASK", about)
    about = "the biped's motor gives the nearest torque without slip or fall by this margin (0.02)"
    add("--shield MARGIN", about, nargs="?", type=float, const=0.02)
    about = "compute the biped's motion in MuJoCo: both feet touch the floor and may lift"
    add("--in", about, dest="program", choices=("mujoco",))
    about = "write evaluation.csv and .json there; of all tasks, ranking.md, .png and results files"
    add("--out DIR", about)
    add("--overwrite", "replace what is in --out", action="store_true")
    _add_scene(parser, many=True)


def record_flags(parser: Parser, _: object) -> None:
    """Add policies, task, noise and the data set."""
    add = parser.add
    add("who POLICY", POLICY, nargs="+")
    add("--task TASK", "of `stickslip tasks` (default: the policies' own)")
    about = "shares of each action that are random, 0 to 1 (default: 0)"
    add("--noise SHARE", about, nargs="+", type=float, default=[0.0])
    add("--episodes", "of each policy with each noise", type=int, default=30)
    add("--seed", "of the first episode (default: behind those of tests)", type=int, default=2**20)
    add("--dataset NAME", "of the data set (default: stickslip/TASK/episodes-v0)")
    about = "of the UGV: infos say what each step lost against dynamic programming"
    add("--regret", about, action="store_true")
    parser.tables = {"policies": shipped_titles()} | _names_of(machines())


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
    add("--resume", "continue the sweep in --out, if there is one", action="store_true")
    add("--no-pictures", "no sweep.png", action="store_true")
    group = parser.add_argument_group(f"the task of the {machine.title}")
    about = "tasks of `stickslip tasks` (default: the policies' own, or the standard task)"
    group.add_argument("--task", nargs="+", metavar="TASK", help=about)
    group.add_argument("--scene", metavar="NAME", help="another floor or ground, see below")
    for option, how in machine.options.items():
        group.add_argument(flag_of(option), **how)
    parser.add_parts(machine.configuration.PARTS)
    axes = {**machine.axes, "PART.NAME": "any other number, see docs/sweeps.md"}
    parser.tables = {"values": AXIS_VALUES, f"axes of the {machine.title}": axes}
    parser.tables |= _names_of([machine])


def _names_of(every: Sequence[Machine]) -> dict[str, Mapping[str, str]]:
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
    """Add the names of tasks or of policies."""
    titles = {name: task.title for name, task in TASKS.items()}
    named = {"tasks": titles, "policies": shipped_titles()}
    parser.tables = {title: of for title, of in named.items() if parser.prog.endswith(title)}
    parser.add("names NAME", "one or more of those below", nargs="*")


policies_flags = tasks_flags


def export_flags(parser: Parser, _: object) -> None:
    """Add the policy or the machine, and the files."""
    add = parser.add
    add("who POLICY", "one of those below, a file, a run, or a robot's file in TOML")
    add("--out FILE", "a policy as .onnx")
    add("--mjcf FILE", "a robot for MuJoCo: closed loops, floor, motor, two feet")
    add("--urdf FILE", "a robot as URDF: a tree, whose loops are cut")
    add("--mu", "friction of the floor for MuJoCo, static and kinetic (default: 0.5)", type=float)
    add("--overwrite", "replace the files", action="store_true")
    parser.add_parts(("robot", "bars", "motor"))
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
    parser.add_parts(("robot", "bars", "vehicle"))
    parser.tables = {"figures": {name: one.title for name, one in FIGURES.items()}}


def _add_scene(parser: Parser, many: bool) -> None:
    """Add the scene and changes of the task, machine by machine."""
    every = machines()
    usual = [(not many and one.viewed_scene) or one.scenes[0] for one in every if one.scenes]
    default = f"(default: the policy's own; for baselines alone {' or '.join(usual)})"
    name, about = f"--scene NAME{',...' if many else ''}", f"floor or ground, see below {default}"
    parser.add(name, about, dest="scenes", type=lambda text: text.split(",") if many else [text])
    parser.add_parts([part for machine in every for part in machine.configuration.PARTS])
    parser.numbers = True
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
    parser.add_parts(("robot", "bars", "vehicle", "motor"))


def identify_flags(parser: Parser, _: object) -> None:
    """Add the log and what is to be found in it."""
    add = parser.add
    add("log LOG", "a table of time [s], torque, held to the next row [N m], and crank angle [rad]")
    add_machine(parser, "robot", "bars")
    about = "what to find beside the frictions (default: payload)"
    add("--unknown", about, nargs="*", choices=tuple(UNKNOWNS), default=["payload"])
    add("--noise", "of one angle [rad] (default: what the log shows)", type=float)
    add("--out PNG", "the picture (default: LOG with .png)")
    add("--overwrite", "replace the picture", action="store_true")


def simulate_flags(parser: Parser, machine: str) -> None:
    """Add the flags of a simulation of the machine."""
    add, rows = parser.add, "walk.csv"
    if machine == "biped":
        _add_walk(parser)
    else:
        rows = "drive.csv"
        add("--posture", "stations.csv of `stickslip optimise ugv`, or its directory")
        about = "instead: rear and front leg, held [degrees]; 90: straight down, more: outwards"
        add("--angles", about, type=float, nargs=2)
        _add_track(parser)
    add("--out", "rows with units, .csv", default=rows)
    add("--plot", "also a .png of the numbers")
    add("--film", "also a film: .gif, .png (animated), .webp or .mp4")
    add("--overwrite", "replace the files", action="store_true")


def _add_walk(parser: Parser) -> None:
    """A walk of the biped under a torque."""
    add, put = parser.add, parser.put
    about = (
        "of the motor [N m], held for each --period: a number, a .csv of times and torques, or "
        "arithmetic, see below"
    )
    add("--torque TORQUE", about)
    about = (
        "instead: crank rate [rad/s], a number or a .csv over time or crank angle, straight "
        "between the ends of each --period"
    )
    add("--rate RATE", about)
    add("--seconds", "to walk (default: 6, or the length of a file over time)", type=float)
    about = "between two rows, for which a torque is held [s], shortened to divide --seconds"
    add("--period", about, type=float, default=0.02)
    add("--crank-rate", "at the start [rad/s] (default: 0)", type=float)
    about = f"a floor: {', '.join(SCENES)} (default: {SCENES[0]})"
    add("--scene NAME", about, choices=SCENES)
    add("--mu-static", "one floor instead, or one for each patch", type=float, nargs="+")
    add("--mu-kinetic", "kinetic friction (default: the static one)", type=float, nargs="+")
    add("--edges", "of patches, where friction changes [m]", type=float, nargs="+")
    add("--payload", "mass on the hip, beside the robot's own [kg]", type=float)
    about = "fidelity, integrator, step and precision, see below"
    add("--setting NAME", about, choices=tuple(SETTINGS), default="exact")
    put("phase", "crank angle at the start [rad] (default: pi/2)", type=float)
    put("foot_velocity", "at the start [m/s]", type=float, default=0.0)
    put("joints", "also the 68 components of the joints' forces", type=truth, default=False)
    add_machine(parser, "robot", "bars")
    parser.tables = {"names in a torque": TORQUE_NAMES, "settings": SETTINGS}


def _add_track(parser: Parser) -> None:
    """Ground, waypoints and limits of a drive."""
    add, put = parser.add, parser.put
    add("--track TRACK", f"{', '.join(TRACKS)}, or a file of x and y or GPX", default="bump")
    about = "of the track, as often as needed: height=0.2; see below"
    add("--track-option NAME=VALUE", about, dest="track_options", action="append", default=[])
    about = "treatments of the file's points: merge,outliers=1,noise=0.2m,envelope; see below"
    add("--ground NAME=LENGTH,...", about)
    add("--friction", "under the wheels where the track has no mu [-]", type=float, default=0.8)
    about = "of each wheel's motor [N m], or none (default: of the vehicle's file)"
    add("--max-torque", about, type=limit)
    put("leg_rate", "of a leg along the way [rad/m], or none", type=limit, default=1.0)
    put("spacing", "of waypoints [m] (default: 0.1)", type=float)
    put("start", "first place of the front wheel [m]", type=float)
    put("end", "last place of the front wheel [m]", type=float)
    add_machine(parser, "vehicle")
    options = {name: ", ".join(words) for name, words in TRACK_OPTIONS.items()}
    parser.tables = {"track options": options | {"a file": "interpolation"}}
    parser.tables |= {"treatments of ground": TREATMENTS, "criteria": CRITERIA_IN_WORDS}


def add_machine(parser: Parser, name: str, *parts: str) -> None:
    """A machine of one's own, and changes of it. parts: of its file besides its own and motor."""
    parser.add(f"--{name}", f"file in TOML; --set {name}.NAME=VALUE changes a number")
    parser.add_parts((name, *parts, "motor"))


def optimise_flags(parser: Parser, machine: str) -> None:
    """Add the flags of an optimisation of the machine."""
    if machine == "biped":
        _add_gait(parser)
        out = "runs/biped-OBJECTIVE"
    else:
        _add_posture(parser)
        out = "runs/ugv-TRACK-CRITERION-METHOD"
    parser.add("--out DIR", f"directory (default: {out})")
    parser.add("--no-pictures", "no plot", dest="pictures", action="store_false")
    parser.add("--overwrite", "replace the result in --out", action="store_true")


def _add_posture(parser: Parser) -> None:
    """A posture problem and the method that solves it."""
    add, put = parser.add, parser.put
    add("--criterion NAME", "objective, see below", default="wheel_energy")
    add("--method NAME", "see below", default="dp")
    add("--seed", "of the method cma", type=int)
    _add_track(parser)
    about = "let the wheels overlap, as the chapter does; no vehicle can"
    put("overlap", about, type=truth, default=False)
    put("free_split", "a motor at each wheel, for more grip", type=truth, default=False)
    for name, place in (("start_angles", "first"), ("end_angles", "last")):
        about = f"rear and front leg at the {place} waypoint [rad] (default: any)"
        put(name, about, type=float, nargs=2)
    put("angles", "of each leg on the grid (default: a grid that uses the leg rate)", type=int)
    put("polish", "let scp follow the grid's path (default: up to 2000 waypoints)", type=truth)
    parser.tables |= {"methods": METHODS}


def _add_gait(parser: Parser) -> None:
    """A gait problem."""
    add, put = parser.add, parser.put
    add("--objective NAME", "see below, or a sum: time=1,energy=0.2", default="time")
    about = "static friction, one number or one a step (default: the foot never slips)"
    add("--mu", about, type=float, nargs="+")
    add("--mean-rate", "least mean crank rate [rad/s] (default: any)", type=float)
    about = "of the motor [N m], or none (default: of the robot's file, else 4)"
    add("--torque-limit", about, type=limit)
    add("--payload", "on the hip, beside the robot's own [kg]", type=float, default=0.0)
    add("--steps", "of a walk (default: one periodic step)", type=int)
    about = "kinetic friction of a foot that may slip on a walk (default: it never does)"
    add("--mu-kinetic", about, type=float)
    put("min_normal", "least normal force [N]", type=float, default=0.0)
    put("zmp", "keep the zero-moment point inside the foot", type=truth, default=False)
    about = "for the energy [W/(N m)^2] (default: of the robot's file, else 0.5)"
    put("copper_loss", about, type=float)
    about = "share of friction left unused; 0.02 lets the replay walk without a slip (default: 0; "
    put("reserve", about + "with --mu-kinetic the least that arrives)", type=float)
    put("start", "crank rate when a walk begins [rad/s] (default: 0)", type=float)
    put("end", "crank rate when it ends, 0: a stop (default: any)", type=float)
    put("mark", "where it ends, ahead of the centre of mass [m], in place of --steps", type=float)
    put("most_steps", "the best walk of --steps to so many steps (default: --steps)", type=int)
    put("max_torque_rate", "of the motor [N m/s] (default: any)", type=float)
    put("cells", "of the grid in each step", type=int, default=200)
    put("feedback", "of the second replay [1/rad]; the first one has none", type=float, default=2.0)
    add_machine(parser, "robot", "bars")
    parser.tables = {"objectives": OBJECTIVES, "methods": GAIT_METHODS}


def bench_flags(parser: Parser, part: str) -> None:
    """Add the flags of a race, or of a report of races."""
    add = parser.add
    if part == "report":
        add("source", "directories of races", nargs="+")
        add("--stored", "beside the package's own runs", action="store_true")
        add("--out DIR", "a new directory", required=True)
        return
    add("--out DIR", "directory of the race", required=True)
    about = "names (an unknown one lists them), or your own MODULE:FUNCTION (default: all)"
    add("--methods NAME", about, nargs="+")
    add("--instances ID", "ids of the suite, -s1 at the end for seed 1 (default: all)", nargs="+")
    add("--budget", "values and gradients of a run", type=int)
    add("--seconds", "processor time of a run", type=float)
    add("--seeds", "of each method on each instance", type=int, default=3)
    add("--resume", "continue the race in --out, if there is one", action="store_true")
    about = "time [s] after which a run is killed, with its start and compiling"
    add("--limit SECONDS", about, type=float, default=120.0)
    add("--workers", "processes (default: cores)", type=int)
