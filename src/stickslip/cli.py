"""The command line: `stickslip train | evaluate | sweep | compare | view | ...`.

Here are the flags only, with names and defaults from modules that need neither JAX nor NumPy; each
command's work is imported when it is run. Wrong input is a one-line message on stderr and exit
status 2.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn, cast

from stickslip.parser import Names, Parser, add_tables
from stickslip.programs import compiled_programs

OK, NOTHING_FOUND, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
LONGEST = 1200
"""Characters of a message."""
EXHAUSTED = "RESOURCE_EXHAUSTED"
"""What XLA calls a lack of memory."""
EXTRAS = {
    "stable_baselines3": "train",
    "torch": "train",
    "tensorboard": "train",
    "tqdm": "train",
    "cma": "optim",
    "matplotlib": "viz",
    "PIL": "viz",
    "pygame": "viz",
    "pyarrow": "sweep",
    "distributed": "sweep",
    "filelock": "sweep",
    "onnx": "onnx",
}
"""Optional packages and the extra that brings them."""
AddFlags = Callable[[argparse.ArgumentParser, Sequence[str]], None]
WHO = "a policy of the package, a policy file, a run's directory or a baseline, see below"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status: 0, 1 where optimise finds no drive or gait, 2 for
    wrong input, 130 after Ctrl-C."""
    try:
        parser = make_parser(sys.argv[1:] if arguments is None else arguments)
        given = parser.parse_args(arguments)
        with compiled_programs(keep=given.keep_programs):
            return given.run(given)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        _complain(
            f"this needs {package}, which is not installed; run: "
            f'pip install "stickslip[{EXTRAS[package]}]"'
        )
    except BrokenPipeError:  # whoever read the output has left; so does the interpreter at its end
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
    except (ValueError, OSError) as error:
        _complain(str(error))
    except MemoryError as error:
        _complain(f"not enough memory ({error or 'for what was asked'}); accepted: less at once")
    except RuntimeError as error:
        if EXHAUSTED not in str(error):
            raise
        _complain(f"not enough memory ({error}); accepted: less at once")
    except KeyboardInterrupt:
        _complain("interrupted")
        return INTERRUPTED
    return WRONG_INPUT


def make_parser(arguments: Sequence[str] = ()) -> Parser:
    """The parser. A command has its flags only if it is among the arguments."""
    parser = Parser(
        prog="stickslip",
        description="A biped that sticks or slips and a UGV on two legs: train, compare, look.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (add_flags, run, about) in COMMANDS.items():
        described = f"{about[0].upper()}{about[1:]}."
        command = commands.add_parser(name, help=about, description=described)
        command.set_defaults(run=run)
        if name in arguments:
            add_flags(command, arguments)
        command.add_argument(
            "--no-cache",
            dest="keep_programs",
            action="store_false",
            help="compile everything again, and keep no compiled program for the next command",
        )
    return parser


class _Version(argparse.Action):
    """Looks the version up only when asked."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from stickslip import __version__

        print(f"stickslip {__version__}")
        raise SystemExit(OK)


def _add_train(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.agents.registry import machine_among, machines
    from stickslip.agents.training.configuration import add_flags

    machine = machine_among(arguments)
    parser.add_argument(
        "machine",
        nargs="?",
        choices=[one.name for one in machines()],
        default=machine.name,
        help=f"what to train (default: {machines()[0].name}, or whose --task is); each has "
        "settings of its own, see --help after its name",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="directory of the run (default: runs/<machine>-<time>)"
    )
    parser.add_argument("--resume", action="store_true", help="go on with the run in --out")
    parser.add_argument("--overwrite", action="store_true", help="begin the run in --out anew")
    parser.add_argument(
        "--no-pictures", action="store_true", help="no plots, no animation, no report.html"
    )
    _add_devices(parser)
    parser.description = (
        f"{parser.description} The settings of train {machine.name} come after the options; "
        "config.json keeps them."
    )
    add_flags(parser, machine.configuration)


def _add_devices(parser: argparse.ArgumentParser) -> None:
    """What is learnt on; no part of the configuration, since the learning curve is the same."""
    group = parser.add_argument_group("devices (trainer jax)")
    group.add_argument(
        "--devices",
        type=int,
        metavar="INT",
        help="of this process, that the environments are divided among (default: all)",
    )
    group.add_argument(
        "--coordinator",
        metavar="HOST:PORT",
        help="of the first of several processes that train together; auto: as JAX finds it",
    )
    group.add_argument("--process", type=int, metavar="INT", help="which one this is, from 0")
    group.add_argument("--processes", type=int, metavar="INT", help="how many they are")


def _add_evaluate(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    parser.add_argument("who", nargs="+", metavar="POLICY", help=WHO)
    parser.add_argument(
        "--episodes", type=int, help="for each (default: 32; of a task, those it was measured on)"
    )
    parser.add_argument(
        "--task",
        metavar="TASK",
        help="a task of `stickslip tasks`, in place of the policies' own: with scores and the gap",
    )
    parser.add_argument(
        "--bound",
        action="store_true",
        help="UGV: also what no drive can beat, proved, some seconds to minutes an episode",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="write evaluation.csv and .json and report.html there"
    )
    parser.add_argument("--html", metavar="FILE", help="the report alone, or elsewhere")
    parser.add_argument("--overwrite", action="store_true", help="replace what is in --out")
    _add_scene(parser, many=True)


def _add_sweep(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.agents.registry import machine_among, machines
    from stickslip.agents.sweeps.flags import add_flags

    parser.add_argument(
        "machine",
        choices=[machine.name for machine in machines()],
        help="whose policies; each has axes of its own, see --help after its name",
    )
    add_tables(parser, add_flags(parser, machine_among(arguments)))


def _add_compare(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.agents.sweeps.flags import add_compare_flags

    add_compare_flags(parser)


def _add_view(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    parser.add_argument(
        "who", nargs="+", metavar="POLICY", help=f"{WHO}; several with --html, also pages of it"
    )
    parser.add_argument(
        "--html", metavar="FILE", help="a page to play in a browser, with curves; of one or several"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the episode (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=6.0, help="to show (default: %(default)s)")
    parser.add_argument("--out", metavar="FILE", help=".gif, .png (animated), .webp or .mp4")
    parser.add_argument("--plot", metavar="FILE", help="also a .png of the episode over time")
    parser.add_argument("--overwrite", action="store_true", help="replace the files")
    parser.add_argument("--window", action="store_true", help="show it on the screen instead")
    _add_scene(parser, many=False)


def _add_scene(parser: argparse.ArgumentParser, many: bool) -> None:
    """Which scene, and what else of the task to change, machine by machine."""
    from stickslip.agents.registry import machines

    every = machines()
    names = [name for machine in every for name in machine.scenes]
    several: dict[str, Any] = {"action": Names, "names": names}
    how: dict[str, Any] = several if many else {"nargs": 1}
    usual = [machine.usual_scene(viewed=not many) for machine in every if machine.scenes]
    parser.add_argument(
        "--scene",
        dest="scenes",
        metavar="NAME",
        **how,
        help="floor or ground, see below (default: the policy's own; for baselines alone "
        f"{' or '.join(usual)})"
        + ("; more names may follow, and the flag may come again" if many else ""),
    )
    for machine in every:
        under = parser.add_argument_group(f"for the {machine.title}")
        for option in machine.options(viewed=not many):
            if option.flag not in parser._option_string_actions:
                under.add_argument(
                    option.flag,
                    type=option.kind,
                    metavar=option.metavar,
                    choices=option.choices,
                    help=option.about,
                )
    tables: dict[str, Mapping[str, str]] = {
        "baselines": {one.title: ", ".join(one.baselines) for one in every if one.baselines},
        "scenes": {
            one.title: ", ".join(filter(None, (*one.scenes, one.scene_files)))
            for one in every
            if one.scenes
        },
    } | _shipped()
    for machine in every:
        tables |= machine.tables()
    add_tables(parser, tables)


def _add_demo(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.agents.registry import machines

    names = [machine.name for machine in machines()]
    parser.add_argument(
        "machine",
        nargs="?",
        choices=names,
        default=names[0],
        help="whose demo (default: %(default)s)",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        default="runs",
        help="where its directory goes (default: %(default)s)",
    )
    parser.add_argument(
        "--fresh", action="store_true", help="train again, in a new directory beside the old one"
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="SECONDS",
        help="stop training after so long and show how far it came (default: none)",
    )


def _add_tasks(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.envs.tasks.ladder import TASKS

    parser.add_argument("names", nargs="*", metavar="NAME", help="one or more of those below")
    parser.add_argument("--json", action="store_true", help="print JSON, with every number")
    add_tables(parser, {"tasks": {name: task.title for name, task in TASKS.items()}})


def _add_policies(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    parser.add_argument("names", nargs="*", metavar="NAME", help="one or more of those below")
    parser.add_argument("--json", action="store_true", help="print JSON, with every number")
    add_tables(parser, _shipped())


def _add_export(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    parser.add_argument("who", metavar="POLICY", help="one of those below, a file or a run")
    parser.add_argument(
        "--out", metavar="FILE", required=True, help=".onnx, or .npz for NumPy alone"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the file")
    add_tables(parser, _shipped())


def _shipped() -> dict[str, Mapping[str, str]]:
    """The package's policies and what each does, for the end of a command's help."""
    from stickslip.agents.shipped.names import shipped_titles

    return {"policies": shipped_titles()}


def _add_optimise(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.optimise.flags import add_flags
    from stickslip.optimise.gait_flags import add_gait_flags

    machines = ("ugv", "biped")
    parser.add_argument(
        "machine",
        choices=machines,
        help="what to optimise: the UGV's leg angles or the biped's gait; each has flags of its "
        "own, see --help after its name",
    )
    named = next((word for word in arguments if word in machines), machines[0])
    (add_gait_flags if named == "biped" else add_flags)(parser)


def _add_reproduce(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    from stickslip.paper.registry import EVERYTHING, FIGURES

    parser.add_argument(
        "figures",
        nargs="+",
        metavar="FIGURE",
        help=f"one or more of those below, or {EVERYTHING}",
    )
    parser.add_argument(
        "--out", metavar="DIR", default="figures", help="where files go (default: %(default)s)"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files in --out")
    parser.add_argument(
        "--samples",
        type=int,
        default=240,
        metavar="N",
        help="points a step; of fig24 along the bump (default: %(default)s)",
    )
    add_tables(parser, {"figures": {name: one.title for name, one in FIGURES.items()}})


def _train(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import train_command

    return OK if train_command(vars(given)) else INTERRUPTED


def _evaluate(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import evaluate_command

    evaluate_command(vars(given))
    return OK


def _sweep(given: argparse.Namespace) -> int:
    from stickslip.agents.sweeps.command import sweep_command

    return OK if sweep_command(vars(given)) else INTERRUPTED


def _compare(given: argparse.Namespace) -> int:
    from stickslip.agents.sweeps.compare import compare_command

    compare_command(vars(given))
    return OK


def _view(given: argparse.Namespace) -> int:
    if given.html is not None:
        from stickslip.agents.reports.view import view_page_command

        view_page_command(vars(given))
        return OK
    from stickslip.agents.commands import view_command

    view_command(vars(given))
    return OK


def _demo(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import demo_command

    return OK if demo_command(vars(given)) else INTERRUPTED


def _tasks(given: argparse.Namespace) -> int:
    from stickslip.tasks_command import tasks_command

    tasks_command(given.names, given.json)
    return OK


def _policies(given: argparse.Namespace) -> int:
    from stickslip.agents.shipped.command import policies_command

    policies_command(given.names, given.json)
    return OK


def _export(given: argparse.Namespace) -> int:
    from stickslip.agents.shipped.command import export_command

    export_command(given.who, given.out, given.overwrite)
    return OK


def _optimise(given: argparse.Namespace) -> int:
    if given.machine == "biped":
        from stickslip.optimise.gait_command import optimise_gait_command
        from stickslip.optimise.gait_flags import GaitFlags

        flags = cast("GaitFlags", vars(given))
        return OK if optimise_gait_command(flags) else NOTHING_FOUND
    from stickslip.optimise.command import optimise_command

    return OK if optimise_command(vars(given)) else NOTHING_FOUND


def _reproduce(given: argparse.Namespace) -> int:
    from stickslip.paper.command import reproduce_command

    reproduce_command(vars(given))
    return OK


COMMANDS: dict[str, tuple[AddFlags, Callable[[Any], int], str]] = {
    "train": (_add_train, _train, "train a policy with PPO or SAC"),
    "evaluate": (_add_evaluate, _evaluate, "compare policies and baselines in a table"),
    "sweep": (
        _add_sweep,
        _sweep,
        "policies at every point of a grid of frictions, loads, speeds and more, into a directory",
    ),
    "compare": (_add_compare, _compare, "two sweeps side by side"),
    "view": (_add_view, _view, "an animation or a page of a policy or baseline at work"),
    "demo": (_add_demo, _demo, "train a machine on a task of its own and compare it"),
    "tasks": (_add_tasks, _tasks, "named tasks that never change, and the best known on each"),
    "policies": (_add_policies, _policies, "trained policies of the package, one for each task"),
    "export": (_add_export, _export, "a policy as ONNX, or as a NumPy archive"),
    "optimise": (
        _add_optimise,
        _optimise,
        "a UGV's leg angles along a track, or the biped's best gait",
    ),
    "reproduce": (
        _add_reproduce,
        _reproduce,
        "compute the chapter's figures again and compare its claims with what comes out",
    ),
}
"""What adds a command's flags, what runs it and what it does, in the order of the help."""


def _complain(message: str) -> None:
    line = " ".join(message[: 2 * LONGEST].split())
    line = line if len(line) <= LONGEST else f"{line[:LONGEST]} ..."
    print(f"stickslip: error: {line}", file=sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main())
