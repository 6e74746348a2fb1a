"""The command line: `stickslip train | evaluate | view | demo | optimise | reproduce`.

Here are the flags only; each command's work is imported when it is run. Wrong input is a one-line
message on stderr and exit status 2.
"""

from __future__ import annotations

import argparse
import difflib
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

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
}
"""Optional packages and the extra that brings them."""


class _Once(argparse.Action):
    """Refuses an option that is given twice, of which argparse would take the last."""

    given = False

    def __call__(self, parser: Any, namespace: Any, values: Any, option: Any = None) -> None:
        if option is not None and self.given:
            parser.error(f"{'/'.join(self.option_strings)} is given twice")
        self.given = True
        super().__call__(parser, namespace, values, option)


class _StoreOnce(_Once, argparse._StoreAction):
    pass


class _SwitchOnce(_Once, argparse.BooleanOptionalAction):
    pass


class Parser(argparse.ArgumentParser):
    """Raises ValueError where argparse would print the usage and exit, and for options that are
    given twice or shortened. A parser reads one command line."""

    def __init__(self, *arguments: Any, **options: Any):
        super().__init__(*arguments, allow_abbrev=False, **options)
        for name in (None, "store"):
            self.register("action", name, _StoreOnce)
        self.register("action", argparse.BooleanOptionalAction, _SwitchOnce)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """As ever; an option that the command does not have is told first, with the nearest."""
        words = list(sys.argv[1:] if args is None else args)
        command = self._command_in(words)
        known = {*self._option_string_actions, *command._option_string_actions}
        for word in words[: words.index("--") if "--" in words else None]:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in known:
                near = difflib.get_close_matches(name[:200], known, n=1)
                meant = f" (did you mean {near[0]}?)" if near else ""
                command.error(f"unrecognized arguments: {name[:200]}{meant}")
        return super().parse_args(words, namespace)

    def _command_in(self, words: Sequence[str]) -> argparse.ArgumentParser:
        """The parser of the command that is called, or this one."""
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                return next((action.choices[one] for one in words if one in action.choices), self)
        return self

    def error(self, message: str) -> NoReturn:
        """What argparse calls."""
        raise ValueError(f"{message} (see {self.prog} --help)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status: 0, 1 where optimise finds no drive, 2 for wrong
    input, 130 after Ctrl-C."""
    try:
        parser = make_parser(sys.argv[1:] if arguments is None else arguments)
        given = parser.parse_args(arguments)
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
    """The parser. Flags made from a configuration are added only if their command is among the
    arguments, since they need more than the standard library."""
    parser = Parser(
        prog="stickslip",
        description="A biped that sticks or slips and a UGV on two legs: train, compare, look.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_train(commands, arguments)
    _add_evaluate(commands)
    _add_view(commands)
    _add_demo(commands)
    _add_optimise(commands)
    _add_reproduce(commands)
    return parser


class _Version(argparse.Action):
    """Looks the version up only when asked."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from stickslip import __version__

        print(f"stickslip {__version__}")
        raise SystemExit(OK)


def _add_train(commands: Any, arguments: Sequence[str]) -> None:
    parser = _command(commands, "train", _train, "train a policy with PPO or SAC")
    parser.add_argument(
        "machine",
        nargs="?",
        choices=("biped", "ugv"),
        default="biped",
        help="what to train (default: biped); each has flags of its own, see --help after its name",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="directory of the run (default: runs/<machine>-<time>)"
    )
    parser.add_argument("--resume", action="store_true", help="go on with the run in --out")
    parser.add_argument("--overwrite", action="store_true", help="begin the run in --out anew")
    parser.add_argument("--no-pictures", action="store_true", help="no plots, no animation")
    if "train" in arguments:
        from stickslip.agents.config_fields import add_flags
        from stickslip.agents.machines import config_kind, machine_named

        group = parser.add_argument_group("configuration, kept in config.json")
        add_flags(group, config_kind(machine_named(arguments)))


def _add_evaluate(commands: Any) -> None:
    parser = _command(commands, "evaluate", _evaluate, "compare policies and baselines in a table")
    parser.add_argument(
        "who", nargs="+", metavar="POLICY", help="a policy file, a run's directory or a baseline"
    )
    parser.add_argument("--episodes", type=int, default=32, help="for each (default: 32)")
    parser.add_argument("--out", metavar="DIR", help="write evaluation.csv and .json there")
    parser.add_argument("--overwrite", action="store_true", help="replace what is in --out")
    _add_scene(parser, many=True)


def _add_view(commands: Any) -> None:
    parser = _command(commands, "view", _view, "an animation of a policy or baseline at work")
    parser.add_argument(
        "who", metavar="POLICY", help="a policy file, a run's directory or a baseline"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the episode (default: 0)")
    parser.add_argument("--seconds", type=float, default=6.0, help="to show (default: 6)")
    parser.add_argument("--out", metavar="FILE", help=".gif, .png (animated) or .webp")
    parser.add_argument("--plot", metavar="FILE", help="also a .png of the episode over time")
    parser.add_argument("--overwrite", action="store_true", help="replace the files")
    parser.add_argument("--window", action="store_true", help="show it on the screen instead")
    _add_scene(parser, many=False)


def _add_scene(parser: argparse.ArgumentParser, many: bool) -> None:
    """Which floor, load and start; which ground for the UGV."""
    about = "floor by name" + (", several if you like" if many else "")
    parser.add_argument(
        "--scene",
        dest="scenes",
        metavar="NAME",
        nargs="+" if many else 1,
        help=f"{about}: slippery (default), wet, firm, ice-patch, grip; of the UGV ground by name "
        "or file: random-bump (default), random-rough, random-mixed, bump, sinusoid, ...",
    )
    parser.add_argument("--mu-static", type=float, metavar="MU", help="one floor instead")
    parser.add_argument("--mu-kinetic", type=float, metavar="MU", help="its kinetic friction")
    parser.add_argument("--payload", type=float, metavar="KG", help="mass on the hip [kg]")
    parser.add_argument("--commanded-rate", type=float, metavar="RATE", help="[rad/s] (default: 3)")
    parser.add_argument(
        "--start",
        choices=("moving", "rest"),
        help="from any phase and rate up to the commanded one, or from rest "
        f"(default: {'moving' if many else 'rest'})",
    )
    ugv = parser.add_argument_group("for the UGV")
    ugv.add_argument("--friction", type=float, metavar="MU", help="mu (default: 0.8)")
    ugv.add_argument(
        "--criterion",
        metavar="NAME",
        help="what is to be small (default: the policy's, or wheel_energy)",
    )


def _add_demo(commands: Any) -> None:
    parser = _command(commands, "demo", _demo, "train a walker for a slippery floor and compare it")
    parser.add_argument(
        "--out", metavar="DIR", default="runs", help="where its directory goes (default: runs)"
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


def _add_optimise(commands: Any) -> None:
    from stickslip.optimise.flags import add_flags

    about = "the leg angles to drive a UGV over a track with"
    parser = _command(commands, "optimise", _optimise, about)
    parser.add_argument("machine", choices=("ugv",), help="what to optimise")
    add_flags(parser)


def _add_reproduce(commands: Any) -> None:
    about = "compute the chapter's figures again and compare its claims with what comes out"
    parser = _command(commands, "reproduce", _reproduce, about)
    parser.add_argument(
        "figures",
        nargs="+",
        metavar="FIGURE",
        help="fig11 to fig19, fig24, fig25, scheme (several), or all",
    )
    parser.add_argument(
        "--out", metavar="DIR", default="figures", help="where files go (default: figures)"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files in --out")
    parser.add_argument(
        "--samples",
        type=int,
        default=240,
        metavar="N",
        help="points a step; of fig24 along the bump (default: 240)",
    )


def _command(commands: Any, name: str, run: Callable[[Any], int], about: str) -> Any:
    parser = commands.add_parser(name, help=about, description=about[0].upper() + about[1:] + ".")
    parser.set_defaults(run=run)
    return parser


def _train(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import train_command

    return OK if train_command(vars(given)) else INTERRUPTED


def _evaluate(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import evaluate_command

    evaluate_command(vars(given))
    return OK


def _view(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import view_command

    view_command(vars(given))
    return OK


def _demo(given: argparse.Namespace) -> int:
    from stickslip.agents.commands import demo_command

    return OK if demo_command(vars(given)) else INTERRUPTED


def _optimise(given: argparse.Namespace) -> int:
    from stickslip.optimise.command import optimise_command

    return OK if optimise_command(vars(given)) else NOTHING_FOUND


def _reproduce(given: argparse.Namespace) -> int:
    from stickslip.paper.command import reproduce_command

    reproduce_command(vars(given))
    return OK


def _complain(message: str) -> None:
    line = " ".join(message[: 2 * LONGEST].split())
    line = line if len(line) <= LONGEST else f"{line[:LONGEST]} ..."
    print(f"stickslip: error: {line}", file=sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main())
