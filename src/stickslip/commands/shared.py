"""Flags of several commands: players, scenes and changes of the task."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.parser import Names, add_tables, completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

WHO = "a policy of the package, a policy file, a run's directory or a baseline, see below"


def add_who(parser: argparse.ArgumentParser, about: str = WHO, many: bool = False) -> None:
    """Add players: names and files."""
    nargs = "+" if many else None
    completes(parser.add_argument("who", metavar="POLICY", nargs=nargs, help=about), players())


def add_overwrite(parser: argparse.ArgumentParser, what: str = "the files") -> None:
    """--overwrite, without which nothing that exists is replaced."""
    parser.add_argument("--overwrite", action="store_true", help=f"replace {what}")


def add_scene(parser: argparse.ArgumentParser, many: bool) -> None:
    """Add the scene and changes of the task, machine by machine."""
    from stickslip.agents.registry import machines

    every = machines()
    names = [name for machine in every for name in machine.scenes]
    several: dict[str, Any] = {"action": Names, "names": names}
    how: dict[str, Any] = several if many else {"nargs": 1}
    usual = [machine.usual_scene(viewed=not many) for machine in every if machine.scenes]
    scene = parser.add_argument(
        "--scene",
        dest="scenes",
        metavar="NAME",
        **how,
        help="floor or ground, see below (default: the policy's own; for baselines alone "
        f"{' or '.join(usual)})"
        + ("; more names may follow, and the flag may come again" if many else ""),
    )
    completes(scene, names)
    for machine in every:
        under = parser.add_argument_group(f"for the {machine.title}")
        for option in machine.options(viewed=not many):
            if option.flag not in parser._option_string_actions:
                option.add_to(under)
    tables: dict[str, Mapping[str, str]] = {
        "baselines": {one.title: ", ".join(one.baselines) for one in every if one.baselines},
        "scenes": {
            one.title: ", ".join(filter(None, (*one.scenes, one.scene_files)))
            for one in every
            if one.scenes
        },
    } | shipped()
    for machine in every:
        tables |= machine.tables()
    add_tables(parser, tables)


def shipped() -> dict[str, Mapping[str, str]]:
    """The package's policies and what each does, for the end of a command's help."""
    from stickslip.agents.policy.shipped import shipped_titles

    return {"policies": shipped_titles()}


def players() -> tuple[str, ...]:
    """The package's policies and every machine's baselines."""
    from stickslip.agents.policy.shipped import shipped_names
    from stickslip.agents.registry import machines

    return (*shipped_names(), *(name for one in machines() for name in one.baselines))


def tasks() -> tuple[str, ...]:
    """The tasks of the ladder."""
    from stickslip.envs.tasks.definition import TASKS

    return tuple(TASKS)


def add_columns(group: argparse._ActionsContainer, file: str, example: str) -> None:
    """Add --columns, which names a table's columns."""
    group.add_argument(
        "--columns",
        metavar="NAME=HEAD,...",
        help=f"the columns of {file} whose heads are other names: {example}",
    )
