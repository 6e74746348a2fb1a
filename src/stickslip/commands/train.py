"""`stickslip train`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.commands import Outcome
from stickslip.commands.shared import tasks
from stickslip.parser import completes, flag_of, truth

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from stickslip.agents.training.configuration import Configuration, Field
    from stickslip.parser import Parser

JSON = False
EXAMPLES = {
    "stickslip train biped --task BipedFast-v0 --out runs/fast": "on a named task",
    "stickslip train biped --mu-static 0.1 --timesteps 200000 --seed 3": "a floor of one's own",
    "stickslip train biped --payload 2 --set slip_weight=2 random_mass=0.9,1.1": (
        "other settings, by their names"
    ),
    "stickslip train ugv --tracks bump --out runs/legs": "the UGV's legs, over one ground",
    "stickslip train --out runs/fast --resume": "go on with a run that was cut off",
}


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """The machine, the run, and every setting of the machine's configuration."""
    from stickslip.agents.registry import machine_among, machines

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
    parser.add_argument("--no-pictures", action="store_true", help="no plots, no animation")
    parser.add_argument(
        "--config",
        metavar="FILE",
        help="settings in TOML, or a run's config.json; those of the command line go before them",
    )
    add_fields(parser, machine.configuration)
    completes(parser._option_string_actions.get("--task"), tasks())


def add_fields(parser: Parser, kind: type[Configuration]) -> None:
    """A flag or a setting for each field; only those given appear in the parsed arguments."""
    import argparse

    from stickslip.agents.training.configuration import every_field, rule_of

    for one in every_field(kind):
        rule = rule_of(one)
        options: dict[str, Any] = {"default": argparse.SUPPRESS}
        options["help"] = _about(one, kind).replace("%", "%%")
        if rule.kind is bool:
            options["type"] = truth
        elif rule.kind == "range":
            options |= {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}
        else:
            options |= {"type": rule.kind, "metavar": rule.kind.__name__.upper()}
        if one.name in kind.FLAGS:
            parser.add_argument(flag_of(one.name), dest=one.name, **options)
        else:
            parser.add_setting(one.name, **options)


def _about(one: Field, kind: type[Configuration]) -> str:
    """Help of a field: meaning, accepted names and defaults."""
    from stickslip.agents.training.configuration import every_field, rule_of

    rule = rule_of(one)
    choices = f": {', '.join(rule.choices)}" if rule.choices else ""
    usual = kind.USUALLY.get(one.name, one.default)
    defaults = "none" if usual is None else f"{usual}"
    defaults += ", with a task its own" if one.name in kind.USUALLY else ""
    rules = {of.name: rule_of(of) for of in every_field(kind)}
    for asked in ("algorithm", "trainer"):
        for choice in rules[asked].choices if asked in rules else ():
            others = kind._defaults(**{"algorithm": "ppo", asked: choice})
            other = others.get(one.name, one.default)
            defaults += f"; {choice}: {other}" if other != one.default else ""
    return f"{rule.about}{choices} (default: {defaults})"


def run(given: argparse.Namespace) -> Outcome:
    """Train."""
    from stickslip.agents.commands import train_command

    train_command(vars(given))
    return Outcome()
