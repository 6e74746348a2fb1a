"""The commands of `stickslip` in one table.

NAME_flags of flags.py adds a command's flags to its parser (of a part, where each has flags of its
own) and imports nothing heavy. `run` takes the parsed flags by name and returns a Content, or None;
it is "module:function", imported when its command is asked for. Examples begin the help.
"""

from collections.abc import Callable, Mapping
from pkgutil import resolve_name
from typing import Any, NamedTuple

OK, NOTHING_FOUND, WRONG_INPUT, READER_LEFT = 0, 1, 2, 141
"""Exit statuses. NOTHING_FOUND: no drive, no gait, or a simulated machine that did not get to the
end of what was asked. READER_LEFT: nobody reads the output any more, as shells count it."""


class Command(NamedTuple):
    """json: it returns a Content, for --json. compiles: it runs JAX in this process. parts: names
    and descriptions, where each machine or part has flags of its own."""

    about: str
    run: str
    examples: Mapping[str, str]
    json: bool = True
    compiles: bool = True
    parts: Callable[[], Mapping[str, str]] = dict


def function_of(place: str) -> Any:
    """Import the function that a text "module:function" of this package names."""
    return resolve_name(f"stickslip.{place}")


def _environments() -> Mapping[str, str]:
    return function_of("agents.machine:environments")()


COMMANDS = {
    "train": Command(
        "train a policy with PPO",
        "agents.training.run:train_command",
        {
            "stickslip train biped --task BipedFast-v0 --out runs/fast": "on a named task",
            "stickslip train ugv --tracks bump --out runs/legs": "the UGV's legs, over one ground",
            "stickslip train biped --out runs/fast --resume": "resume an interrupted run",
        },
        json=False,
        parts=_environments,
    ),
    "evaluate": Command(
        "compare policies and baselines in a table",
        "agents.evaluation.command:evaluate_command",
        {
            "stickslip evaluate biped-ice crank-speed-pi": "a trained policy beside a baseline",
            "stickslip evaluate --task UGVBump-v1 level-body --json": "scores on a task, as JSON",
            "stickslip evaluate --task all runs/ppo runs/mine --out ranking": "rank two methods",
        },
    ),
    "simulate": Command(
        "a walk under a torque, or a drive with given leg angles, as data and a picture",
        "simulate.{part}:simulate_command",
        {
            'stickslip simulate biped --torque "8 * (3 - crank_rate)" --crank-rate 3 --scene wet '
            "--period 0.005 --seconds 3 --plot walk.png": "a control law: rows and a picture",
            "stickslip simulate ugv --angles 60 90 --track bump --plot drive.png": "fixed legs",
        },
        parts=lambda: {"biped": "a walk under a torque", "ugv": "a drive with given leg angles"},
    ),
    "sweep": Command(
        "policies at every point of a grid of frictions, loads, speeds and more, into a directory",
        "agents.sweeps.sweep:sweep_command",
        {
            "stickslip sweep biped --policy biped-ice crank-speed-pi --axis mu=0.03:0.3:10 "
            "--axis payload=0,5,10 --episodes 8 --out runs/mu": "over frictions and loads",
            "stickslip sweep ugv --policy level-body --axis friction=0.05:0.4:4 --out runs/grip "
            "--json": "a baseline over frictions, the summary as JSON",
        },
        parts=_environments,
    ),
    "view": Command(
        "an animation or a page of a policy or baseline at work",
        "agents.pictures.view:view_command",
        {
            "stickslip view biped-ice": "a policy of the package, as biped-ice.gif",
            "stickslip view biped-ice crank-speed-pi --out ice.html": "two, in a browser",
        },
        json=False,
    ),
    "tasks": Command(
        "named tasks that never change, and the best known on each",
        "listing:tasks_command",
        {
            "stickslip tasks": "all of them",
            "stickslip tasks BipedSprint-v1": "one in words: its numbers, and who earned what",
        },
        compiles=False,
    ),
    "policies": Command(
        "trained policies of the package, one for each task",
        "listing:policies_command",
        {
            "stickslip policies": "all of them",
            "stickslip policies biped-ice": "one in words: how it was trained, what it earns",
            "stickslip policies runs/mine": "what the policy of a run, or a policy's file, records",
        },
        compiles=False,
    ),
    "export": Command(
        "a policy as ONNX; a robot for MuJoCo or as URDF",
        "export:export_command",
        {
            "stickslip export biped-ice --out ice.onnx": "for any runtime of ONNX",
            "stickslip export my.toml --mjcf robot.xml --urdf robot.urdf": (
                "the robot of a file, see `stickslip robot`"
            ),
        },
        json=False,
        compiles=False,
    ),
    "record": Command(
        "episodes of policies as a Minari data set, for offline learners",
        "agents.exchange.record:record_command",
        {
            "stickslip record biped-ice": "a trained policy on its task",
            "stickslip record ugv-random-bumps --noise 0 1 --regret": "expert and random, regret",
        },
    ),
    "optimise": Command(
        "a UGV's leg angles along a track, or the biped's best gait",
        "optimise.{part}:optimise_command",
        {
            "stickslip optimise ugv --track bump --track-option height=0.2 --max-torque 400": (
                "least wheel energy over a higher bump, with motors of 400 N m"
            ),
            "stickslip optimise biped --objective friction --mean-rate 3": (
                "the steady gait at 3 rad/s with the least friction"
            ),
        },
        parts=lambda: {"ugv": "leg angles along a track", "biped": "the best gait"},
    ),
    "robot": Command(
        "check a robot's or a vehicle's file, tell what it can do and draw it",
        "robot:robot_command",
        {
            "stickslip robot --new my.toml": "a template of the reference robot, to be changed",
            "stickslip robot my.toml": "closes, mass, start torque, friction; and my.png",
        },
    ),
    "identify": Command(
        "friction, load and the encoder's errors from the log of a walk",
        "identify:identify_command",
        {
            "stickslip identify log.csv --robot my.toml": "friction and payload; and log.png",
            "stickslip identify log.csv --unknown payload encoder_bias encoder_delay": (
                "the encoder's errors, too"
            ),
        },
    ),
    "reproduce": Command(
        "compute the chapter's figures again and compare its claims with what comes out",
        "paper.command:reproduce_command",
        {
            "stickslip reproduce fig13 fig17": "two figures",
            "stickslip reproduce all --out figures --overwrite": "all of them, some minutes",
        },
    ),
    "bench": Command(
        "races of optimisers on the suite's instances",
        "agents.optimisers.racing:{part}_command",
        {
            "stickslip bench run --instances shoot-grip-d10-v1 --methods cma slsqp random "
            "--budget 500 --out runs/race": "three methods on an instance",
            "stickslip bench report runs/race --out runs/report": "tables and plots",
        },
        compiles=False,
        parts=lambda: {
            "run": "run methods on instances into a directory",
            "report": "compare runs: tables, ECDF plots",
        },
    ),
}
GROUPS = {
    "use": ("view", "evaluate", "simulate", "tasks", "policies", "export", "record"),
    "train": ("train",),
    "optimise": ("optimise",),
    "study": ("robot", "identify", "sweep", "reproduce", "bench"),
}
"""The commands by purpose, in the order of the help."""
EXAMPLES = {
    "stickslip view biped-ice": "a trained policy at work, as a film",
    "stickslip train biped --task BipedFast-v0 --out runs/fast": "a policy of one's own on a task",
    "stickslip optimise ugv --track bump": "leg angles that need the least energy over a bump",
    "stickslip simulate biped --torque 1 --film walk.gif": "a walk under a torque, as a film",
    "stickslip COMMAND --help": "a command's flags, names and examples",
}
"""Examples of the whole program."""
