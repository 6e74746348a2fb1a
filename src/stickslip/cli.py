"""The command line: `stickslip train | evaluate | simulate | sweep | view | ...`.

`stickslip.commands` lists them; help loads neither JAX nor NumPy. Wrong input is a one-line message
on stderr and exit status 2. With --json standard output holds one JSON object and nothing else.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, redirect_stdout
from typing import IO, TYPE_CHECKING, NoReturn

from stickslip.commands import COMMANDS, EXAMPLES, GROUPS, OK, READER_LEFT, WRONG_INPUT, function_of
from stickslip.parser import Parser, examples_text, tables_text
from stickslip.programs import compiled_programs
from stickslip.records.signals import Interrupted, complain, discard_output, interruptible

if TYPE_CHECKING:
    from stickslip.commands import Command

__all__ = ["COMMANDS", "OK", "READER_LEFT", "WRONG_INPUT", "main", "make_parser"]
ABOUT = "A one-motor biped whose foot sticks or slips, and a UGV on two steerable legs."
SIGNALLED = 128
"""Exit statuses above are of signals."""
LONGEST = 1200
"""Characters of a message."""
EXTRAS = {"cma": "optim", "onnx": "onnx", "mujoco": "bench", "minari": "data"}
EXTRAS |= dict.fromkeys(("stable_baselines3", "torch"), "sb3")
EXTRAS |= dict.fromkeys(("optax", "tqdm"), "train")
EXTRAS |= dict.fromkeys(("matplotlib", "PIL", "pygame"), "viz")
EXTRAS |= dict.fromkeys(("pyarrow", "filelock"), "sweep")
"""Optional packages and the extra that brings them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status: 0, 1 where nothing was found or a simulated machine
    did not get to the end, 2 for wrong input, 128 and a signal's number where one ended it (130
    after Ctrl-C), 141 where the reader of the output left before its end."""
    prepare_streams()
    try:
        with interruptible():
            words = list(sys.argv[1:] if arguments is None else arguments)
            try:
                return _run(make_parser(words).parse_args(words))
            finally:
                sys.stdout.flush()  # while a failure of that can still be reported
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        _complain(
            f"this needs {package}, which is not installed; run: "
            f'pip install "stickslip[{EXTRAS[package]}]"'
        )
    except BrokenPipeError:
        discard_output("stdout")
        return READER_LEFT
    except OSError as error:
        _complain(f"{error.strerror}: {error.filename!r}" if error.filename else str(error))
    except OverflowError as error:
        _complain(f"a number is too large: {error}")
    except ValueError as error:
        _complain(str(error))
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "RESOURCE_EXHAUSTED" not in str(error):  # XLA's
            raise
        _complain(f"not enough memory ({error or 'for what was asked'}); accepted: less at once")
    except Interrupted as error:
        complain(str(error))
        return error.status
    return WRONG_INPUT


def run() -> NoReturn:
    """Run the command of this process and end it.

    After a signal it ends at once: XLA's threads may still compute, and would crash as the
    interpreter takes down what they use.
    """
    status = main()
    if status > SIGNALLED and status != READER_LEFT:
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


def make_parser(arguments: Sequence[str] = ()) -> Parser:
    """The parser. A command, and a part of it, has its flags only if the arguments name it."""
    tables = {title: {name: COMMANDS[name].about for name in of} for title, of in GROUPS.items()}
    described = "\n\n".join((ABOUT, examples_text(EXAMPLES), tables_text(tables)))
    parser = Parser(prog="stickslip", usage="stickslip COMMAND ...", description=described)
    about, version = "show the version and exit", ""
    if "--version" in arguments:  # it is read from the installed package's metadata
        from stickslip import __version__ as version
    parser.add_argument("--version", action="version", version=f"stickslip {version}", help=about)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    parser._action_groups.pop()  # the description lists them
    for name, one in COMMANDS.items():
        command = commands.add_parser(name, prog=f"stickslip {name}", help=one.about)
        command.set_defaults(command=name)
        if name in arguments:
            _add_parts(command, one, arguments)
    return parser


def _add_parts(parser: Parser, command: Command, arguments: Sequence[str]) -> None:
    """A command's parts with the flags of those among the arguments, or the command's flags."""
    every = command.parts()
    if not every:
        _add_flags(parser, command)
        return
    parser.description = _described(command, command.examples)
    names = "|".join(every)
    parts = parser.add_subparsers(dest="machine", metavar=names, required=True, title="parts")
    for name, about in every.items():
        part = parts.add_parser(name, help=about)
        if name in arguments:
            _add_flags(part, command, name)


def _add_flags(parser: Parser, command: Command, part: str | None = None) -> None:
    """A command's own flags, those that every command has, and examples."""
    function_of(f"flags:{parser.prog.split()[1]}_flags")(parser, part)
    if command.json:
        about = "print one JSON object and nothing else, with every number (docs/commands.md)"
        parser.add_argument("--json", action="store_true", help=about)
    if command.compiles:
        about = "compile everything again, and keep no compiled program for the next command"
        parser.add_argument("--no-cache", dest="keep_programs", action="store_false", help=about)
    lines = (one for one in command.examples if part is None or part in one.split()[:3])
    shown = {line: command.examples[line] for line in lines}
    parser.description = _described(command, shown)


def _described(command: Command, examples: Mapping[str, str]) -> str:
    return f"{command.about[0].upper()}{command.about[1:]}.\n\n{examples_text(examples)}"


def _run(given: argparse.Namespace) -> int:
    """Run the command that was named; with --json all that it prints for people is left out."""
    flags = vars(given)
    name, as_json = flags.pop("command"), flags.pop("json", False)
    command = COMMANDS[name]
    with ExitStack() as stack:
        if as_json:
            nowhere = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
            stack.enter_context(redirect_stdout(nowhere))
        if command.compiles:
            stack.enter_context(compiled_programs(keep=flags.pop("keep_programs")))
        found = function_of(command.run.format(part=flags.get("machine")))(flags)
    if as_json:
        print(found.json(name), end="")
    return OK if found is None else found.status


def prepare_streams() -> None:
    """Make both fit to print on: a closed one leads nowhere (it is None in Python, which would
    print errors on the other), and a letter that the encoding lacks becomes a question mark."""
    for name in ("stdout", "stderr"):
        stream: IO[str] | None = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif getattr(stream, "errors", None) == "strict" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # pyright: ignore[reportAttributeAccessIssue]


def _complain(message: str) -> None:
    line = " ".join(message[: 2 * LONGEST].split())
    line = line if len(line) <= LONGEST else f"{line[:LONGEST]} ..."
    print(f"stickslip: error: {line}", file=sys.stderr)


if __name__ == "__main__":
    run()
