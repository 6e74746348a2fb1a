"""Names and files of the package's trained policies.

The policy of BipedIce-v0 is the file biped-ice-v0.npz; "biped-ice" is that of the latest version.
Names are read without JAX, so that help is quick.
"""

from __future__ import annotations

import re
from pathlib import Path

from stickslip.dynamics.checks import nearest
from stickslip.envs.tasks.definition import TASKS

FOLDER = Path(__file__).parent / "trained"
SUFFIX = ".npz"
WORDS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
"""Boundaries of words in a task's name: Biped|Ice|Seen, UGV|Low|Grip."""
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,99}")
"""Pattern of a name; anything else is a path."""
VERSIONED = re.compile(r"(.+)-v(\d{1,6})")


def policy_name(task: str) -> str:
    """The full name of a task's policy: "biped-ice-v0" of "BipedIce-v0"."""
    return WORDS.sub("-", task).lower()


def shipped_names(folder: Path = FOLDER) -> tuple[str, ...]:
    """Names of the policies without their versions, in the order of the ladder."""
    order = [_stem(policy_name(task)) for task in TASKS]
    found = {_stem(path.stem) for path in folder.glob(f"*{SUFFIX}")}
    known = [name for name in dict.fromkeys(order) if name in found]
    return (*known, *sorted(found - set(known)))


def shipped_titles() -> dict[str, str]:
    """Titles of the policies' tasks, by the policies' names."""
    titles = {_stem(policy_name(task.name)): task.title for task in TASKS.values()}
    return {name: titles.get(name, "") for name in shipped_names()}


def shipped_path(name: str, folder: Path = FOLDER) -> Path | None:
    """The file of a name, the latest one where it has no version; None where there is none.

    The task's own name is accepted, too.
    """
    if not NAME.fullmatch(name):
        return None
    plain = policy_name(name)
    found = {path.stem: path for path in folder.glob(f"*{SUFFIX}")}
    if plain in found:
        return found[plain]
    versions = [one for one in found if _stem(one) == plain]
    return found[max(versions, key=_version)] if versions else None


def no_policy(name: str) -> str:
    """The message for a word that is neither a policy of the package nor a file."""
    names = shipped_names()
    return (
        f"{name!r} is neither a policy of the package nor a file; accepted: {', '.join(names)}, a "
        f"policy file, or the directory of a run with one{nearest(policy_name(name), names)}"
    )


def _stem(name: str) -> str:
    match = VERSIONED.fullmatch(name)
    return name if match is None else match.group(1)


def _version(name: str) -> int:
    match = VERSIONED.fullmatch(name)
    return -1 if match is None else int(match.group(2))


def short_name(path: Path) -> str:
    """The name of a policy's file, without a version where it is the latest."""
    stem = _stem(path.stem)
    return stem if shipped_path(stem, path.parent) == path else path.stem
