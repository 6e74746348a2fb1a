"""The parser of the command line: flags, settings, refusals as ValueError.

A command has flags for what is often asked and settings for the rest: `--set name=value`.
"""

import argparse
import math
import re
import shutil
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any, NoReturn

from stickslip.dynamics.checks import nearest, require_known, shown


class _Help(argparse.RawDescriptionHelpFormatter):
    """Names values by their type, ends with the default, and breaks no name at its hyphens."""

    def _get_default_metavar_for_optional(self, action: argparse.Action) -> str:
        return metavar_of(action)

    def _get_help_string(self, action: argparse.Action) -> str:
        return help_of(action).replace("%", "%%")

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)


class Parser(argparse.ArgumentParser):
    """Raises ValueError where argparse would print the usage and exit, and for shortened flags.

    tables: names and meanings at the end of the help, by title. settings: by name, the actions that
    read their values. parts: of `--set PART.NAME=VALUE`, which `changes` holds. numbers: whether
    `--set NAME=VALUE` may have any other name, which `numbers` holds.
    """

    def __init__(self, **options: Any):
        super().__init__(**{"formatter_class": _Help, "allow_abbrev": False} | options)
        self.tables: dict[str, Mapping[str, str]] = {}
        self.settings: dict[str, argparse.Action] = {}
        self.parts, self.numbers = set[str](), False

    def add(self, name: str, about: str, **options: Any) -> None:
        """Add a flag, as "--out DIR" with its value's name, by the options of `add_argument`."""
        name, _, value = name.partition(" ")
        self.add_argument(name, help=about, **({"metavar": value} if value else {}), **options)

    def put(self, name: str, about: str, **options: Any) -> None:
        """Add a setting with the options of `add_argument`; nargs: values between commas."""
        self._add_set()
        action = argparse._StoreAction([name], dest=name, help=about, **options)
        self.settings[name] = action
        if action.default is not argparse.SUPPRESS:
            self.set_defaults(**{name: action.default})

    def add_parts(self, parts: Iterable[str]) -> None:
        """Take `--set PART.NAME=VALUE` for these parts, as texts by dotted names in `changes`."""
        self._add_set()
        self.parts |= set(parts)

    def _add_set(self) -> None:
        if "--set" not in self._option_string_actions:
            about = "settings below; the flag may come again"
            self.add("--set NAME=VALUE", about, nargs="+", action="extend", default=[])

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """Parse, and refuse unknown flags with the nearest known one.

        A value may begin with a minus, as in `--torque -crank_rate`.
        """
        self._negative_number_matcher = re.compile("-[^-]")
        self._has_negative_number_optionals: list[bool] = []
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            name = unknown[0].partition("=")[0]
            flags = {flag_of(one): f"--set {one}=VALUE" for one in self.settings}
            near = nearest(name, [*self._option_string_actions, *flags])
            near = f"; accepted: {flags[name]}" if name in flags else near
            self.error(f"unrecognized arguments: {name[:200]}{near}")
        if self.settings or self.parts:
            self._set(found, vars(found).pop("set"))
        return found, unknown

    def _set(self, found: argparse.Namespace, words: Iterable[str]) -> None:
        """Store each `name=value`."""
        changes, numbers = dict[str, str](), dict[str, float]()
        for word in words:
            name, equals, text = word.partition("=")
            if not equals:
                self.error(f"--set: {shown(word)}; accepted: NAME=VALUE")
            name = name.replace("-", "_")
            if name.partition(".")[0] in self.parts:
                changes[name] = text
            elif self.numbers:
                try:
                    numbers[name] = float(text)
                except ValueError:
                    self.error(f"--set {name}={text}; accepted: a number")
            else:
                if flag_of(name) in self._option_string_actions:
                    self.error(f"--set {name} is a flag; accepted: {flag_of(name)} VALUE")
                parts = (f"{part}.NAME" for part in sorted(self.parts))
                require_known([name], [*self.settings, *parts], "setting")
                setattr(found, name, self._value(self.settings[name], text))
        if self.parts:
            found.changes = changes
        if self.numbers:
            found.numbers = numbers

    def _value(self, action: argparse.Action, text: str) -> Any:
        words = [text] if action.nargs is None else text.split(",")
        if isinstance(action.nargs, int) and len(words) != action.nargs:
            accepted = f"{action.nargs} values with a comma between them"
            self.error(f"argument {action.dest}: {shown(text)}; accepted: {accepted}")
        try:
            return self._get_values(action, words)
        except argparse.ArgumentError as error:
            self.error(str(error))

    def format_help(self) -> str:
        """Format the help with settings and tables behind the flags."""
        rows = {_setting_in_words(one): help_of(one) for one in self.settings.values()}
        settings = {"settings, as --set NAME=VALUE": rows} if rows else {}
        self.epilog = tables_text(settings | self.tables)
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """Report an error; argparse calls this."""
        raise ValueError(f"{message} (see {self.prog} --help)")


def _setting_in_words(action: argparse.Action) -> str:
    """name=VALUE with as many values as it takes."""
    values = action.metavar or metavar_of(action)
    if isinstance(values, str):
        count = action.nargs if isinstance(action.nargs, int) else 1
        values = (*[values] * count, *(["..."] if action.nargs == "+" else []))
    return f"{action.dest}={','.join(values)}"


def metavar_of(action: argparse.Action) -> str:
    """Name of an action's values in the help, by their type."""
    kind = action.type or str
    return {int: "N", float: "NUMBER", limit: "NUMBER", truth: "BOOL"}.get(kind, "FILE")


def help_of(action: argparse.Action) -> str:
    """An action's description, which ends with a default that is a number or a name."""
    text, default = action.help or "", action.default
    given = isinstance(default, int | float | str) and not isinstance(default, bool)
    if not given or default == argparse.SUPPRESS or "(default" in text:
        return text
    return f"{text} (default: {default})"


def flag_of(name: str) -> str:
    """The flag of a name: --na-me of na_me."""
    return "--" + name.replace("_", "-")


def truth(text: str) -> bool:
    """The value of a setting that is true or false."""
    if text not in ("true", "false"):
        raise argparse.ArgumentTypeError(f"{shown(text)}; accepted: true, false")
    return text == "true"


def limit(text: str) -> float:
    """The value of an option that may be none: infinite then."""
    if text == "none":
        return math.inf
    try:
        return float(text)
    except ValueError:
        message = f"{shown(text)}; accepted: a number > 0, or none"
        raise argparse.ArgumentTypeError(message) from None


def finite(limit: float) -> float | None:
    """A limit, None where it is infinite."""
    return None if limit == math.inf else limit


def tables_text(tables: Mapping[str, Mapping[str, str]]) -> str:
    """Format tables of names and meanings by title."""
    width = max(60, shutil.get_terminal_size().columns - 2)
    blocks = []
    for title, rows in tables.items():
        column = max(map(len, rows)) + 2
        style: dict[str, Any] = {"width": width, "subsequent_indent": " " * (2 + column)}
        style["break_on_hyphens"] = False
        lines = [textwrap.fill(f"  {name:<{column}}{text}", **style) for name, text in rows.items()]
        blocks.append("\n".join([f"{title}:", *lines]))
    return "\n\n".join(blocks)


def examples_text(examples: Mapping[str, str]) -> str:
    """Format command lines and their purposes."""
    lines = (f"  {about}:\n    {line}" for line, about in examples.items())
    return "\n".join(["examples:", *lines])
