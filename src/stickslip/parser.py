"""The parser of the command line: flags, settings, refusals as ValueError.

A command has flags for what is often asked and settings for the rest: `--set name=value`. A
dataclass whose fields are made by `option` and `set_option` declares both.
"""

from __future__ import annotations

import argparse
import math
import re
import shutil
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, field, fields
from functools import partial
from typing import Any, NoReturn, TypeVar, get_args, get_origin, get_type_hints

from stickslip.dynamics.checks import nearest, require_known, shown

T = TypeVar("T")
METAVARS = {float: "NUMBER", int: "N", str: "PATH", bool: "BOOL"}
"""Values in the help, by type."""
Tables = Mapping[str, Mapping[str, str]]
"""Tables of names and meanings, by title."""


def option(default: Any = MISSING, about: str = "", **how: Any) -> Any:
    """A field of a dataclass of options, see `add_options`.

    how: flag: where it is not the field's name; and options of `add_argument`.
    """
    metadata = {"about": about, "how": how}
    if isinstance(default, list):
        return field(default_factory=list, metadata=metadata, kw_only=True)
    return field(default=default, metadata=metadata, kw_only=True)


set_option = partial(option, setting=True)
"""A field that is set by `--set name=value`."""


def changes_option(*parts: str) -> Any:
    """A field with the texts of `--set PART.NAME=VALUE` by dotted names; {} without any."""
    return field(default_factory=dict, metadata={"parts": parts}, kw_only=True)


def add_options(parser: Parser, kind: type) -> None:
    """Add a flag or a setting for each field of a dataclass of options.

    bool: a switch, --no-NAME where it is true by default. list[X]: one or more values. tuple[X, X]:
    two values. X | None: a value. A default that is not None ends the help.
    """
    hints = get_type_hints(kind)
    for one in fields(kind):
        if "parts" in one.metadata:
            parser.add_parts(one.name, one.metadata["parts"])
            continue
        how: dict[str, Any] = dict(one.metadata["how"])
        setting = how.pop("setting", False)
        flag = how.pop("flag", flag_of(one.name))
        default = [] if one.default_factory is list else one.default
        how = _form(hints[one.name], default, setting) | {"help": one.metadata["about"]} | how
        if how.get("action") == "append":
            del how["nargs"]
        if isinstance(default, int | float | str) and not isinstance(default, bool):
            how["help"] += f" (default: {default})"
        if setting:
            parser.add_setting(one.name, **how)
            continue
        how["help"] = how["help"].replace("%", "%%")
        if default is True:
            flag = f"--no-{flag[2:]}"
        parser.add_argument(flag, dest=one.name, **how)


def options_of(kind: type[T], flags: Mapping[str, Any]) -> T:
    """The dataclass of options from parsed flags by name."""
    return kind(**{one.name: flags[one.name] for one in fields(kind)})  # type: ignore[arg-type]


def _form(hint: Any, default: Any, setting: bool) -> dict[str, Any]:
    """Options of `add_argument` for a type."""
    if hint is bool and not setting:
        return {"action": "store_false" if default is True else "store_true"}
    found: dict[str, Any] = {"required": True} if default is MISSING else {"default": default}
    inner = next((one for one in get_args(hint) if one is not type(None)), hint)
    kind = inner if get_origin(hint) not in (list, tuple) else hint
    if get_origin(kind) in (list, tuple):
        found["nargs"] = "+" if get_origin(kind) is list else len(get_args(kind))
        inner = get_args(kind)[0]
    return found | {"type": truth if inner is bool else inner, "metavar": METAVARS[inner]}


class _Help(argparse.RawDescriptionHelpFormatter):
    """Breaks no name at its hyphens."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)


class Parser(argparse.ArgumentParser):
    """Raises ValueError where argparse would print the usage and exit, and for shortened flags.

    tables: names and meanings at the end of the help, by title. settings: by name, the actions that
    read their values. parts: destinations of `--set PART.NAME=VALUE`. numbers: destination of
    `--set NAME=VALUE` with any other name.
    """

    def __init__(self, **options: Any):
        super().__init__(**{"formatter_class": _Help, "allow_abbrev": False} | options)
        self.tables: dict[str, Mapping[str, str]] = {}
        self.settings: dict[str, argparse.Action] = {}
        self.parts: dict[str, str] = {}
        self.numbers = ""

    def add_setting(self, name: str, **options: Any) -> None:
        """Add a setting with the options of `add_argument`; nargs: values between commas."""
        self._add_set()
        if options.get("type") is truth:
            options["metavar"] = "BOOL"
        action = argparse._StoreAction([name], dest=name, **options)
        self.settings[name] = action
        if action.default is not argparse.SUPPRESS:
            self.set_defaults(**{name: action.default})

    def add_parts(self, name: str, parts: Iterable[str]) -> None:
        """Take `--set PART.NAME=VALUE` for these parts, as texts by dotted names under `name`."""
        self._add_set()
        self.parts |= dict.fromkeys(parts, name)

    def _add_set(self) -> None:
        if "--set" not in self._option_string_actions:
            about = "settings below; the flag may come again"
            how: dict[str, Any] = {"nargs": "+", "action": "extend", "default": []}
            self.add_argument("--set", metavar="NAME=VALUE", help=about, **how)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """Parse, and refuse unknown flags with the nearest known one.

        A value may begin with a minus, as in `--torque -crank_rate`.
        """
        self._negative_number_matcher = re.compile("-[^-]")
        self._has_negative_number_optionals: list[bool] = []
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            name = unknown[0].partition("=")[0]
            self.error(f"unrecognized arguments: {name[:200]}{self._nearest(name)}")
        if self.settings or self.parts:
            self._set(found, vars(found).pop("set"))
        return found, unknown

    def _nearest(self, name: str) -> str:
        flags = {flag_of(one): f"--set {one}=VALUE" for one in self.settings}
        if name in flags:
            return f"; accepted: {flags[name]}"
        return nearest(name, [*self._option_string_actions, *flags])

    def _set(self, found: argparse.Namespace, words: Iterable[str]) -> None:
        """Store each `name=value`."""
        for destination in filter(None, {*self.parts.values(), self.numbers}):
            setattr(found, destination, {})
        for word in words:
            name, equals, text = word.partition("=")
            if not equals:
                self.error(f"--set: {shown(word)}; accepted: NAME=VALUE")
            name = name.replace("-", "_")
            if (part := name.partition(".")[0]) in self.parts:
                getattr(found, self.parts[part])[name] = text
            elif self.numbers:
                getattr(found, self.numbers)[name] = self._number(name, text)
            else:
                require_known([name], self.settings, "setting")
                setattr(found, name, self._value(self.settings[name], text))

    def _number(self, name: str, text: str) -> float:
        try:
            return float(text)
        except ValueError:
            self.error(f"--set {name}={text}; accepted: a number")

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
        rows = {_setting_in_words(one): one.help or "" for one in self.settings.values()}
        settings = {"settings, as --set NAME=VALUE": rows} if rows else {}
        self.epilog = tables_text(settings | self.tables)
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """Report an error; argparse calls this."""
        raise ValueError(f"{message} (see {self.prog} --help)")


def _setting_in_words(action: argparse.Action) -> str:
    """name=VALUE with as many values as it takes."""
    values = action.metavar or action.dest.upper()
    if isinstance(values, str):
        count = action.nargs if isinstance(action.nargs, int) else 1
        values = (*[values] * count, *(["..."] if action.nargs == "+" else []))
    return f"{action.dest}={','.join(values)}"


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


def tables_text(tables: Tables) -> str:
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
