"""Names and files of the package's trained policies.

The policy of BipedIce-v0 is the file biped-ice-v0.npz; "biped-ice" is that of the latest version.
Names are read without JAX, so that help is quick.
"""

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


def policy_name(task: str) -> str:
    """The full name of a task's policy: "biped-ice-v0" of "BipedIce-v0"."""
    return WORDS.sub("-", task).lower()


def _latest(folder: Path) -> dict[str, Path]:
    """The file of the latest version by the name without it."""
    paths = sorted(folder.glob(f"*{SUFFIX}"), key=lambda one: (len(one.stem), one.stem))
    return {path.stem.rpartition("-v")[0]: path for path in paths}


def shipped_names(folder: Path = FOLDER) -> tuple[str, ...]:
    """Names of the policies without their versions, in the order of the ladder."""
    found = sorted(_latest(folder))
    order = [policy_name(task.stem) for task in TASKS.values()]
    return tuple(sorted(found, key=lambda name: (*order, *found).index(name)))


def shipped_titles() -> dict[str, str]:
    """Titles of the policies' tasks, by the policies' names."""
    titles = {policy_name(task.stem): task.title for task in TASKS.values()}
    return {name: titles.get(name, "") for name in shipped_names()}


def shipped_path(name: str, folder: Path = FOLDER) -> Path | None:
    """The file of a name, the latest one where it has no version; None where there is none.

    The task's own name is accepted, too.
    """
    if not NAME.fullmatch(name):
        return None
    path = folder / (policy_name(name) + SUFFIX)
    return path if path.is_file() else _latest(folder).get(policy_name(name))


def no_policy(name: str) -> str:
    """The message for a word that is neither a policy of the package nor a file."""
    names = shipped_names()
    return (
        f"{name!r} is neither a policy of the package nor a file; accepted: {', '.join(names)}, a "
        f"policy file, or the directory of a run with one{nearest(policy_name(name), names)}"
    )
