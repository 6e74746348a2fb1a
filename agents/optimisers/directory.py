"""The directory of a race: what it is, and a file for each run that was made."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING

from stickslip.agents.foreign.reading import (
    RefusedError,
    parse_json,
    read_text,
    refusing,
    require_format,
)
from stickslip.agents.sweeps.files.directory import (
    CHUNK,
    DATA,
    chunk_path,
    commit,
    missing_of,
    versions,
)
from stickslip.agents.sweeps.files.parquet import require_chunk
from stickslip.records.files import is_remains, write_whole
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.optimisers.plan import RacePlan
    from stickslip.optim.instances.exports import Foreign

ABOUT, FORMAT, VERSION = "race.json", "stickslip race", 1
PRODUCT = re.compile(r"(results\.(parquet|csv)|report\.(md|html)|.+\.png)")
LIBRARIES = ("cma", "cvxpy", "evosax", "nevergrad", "optuna", "pymoo", "scipy")


def open_race(path: Path, plan: RacePlan, *, resume: bool) -> None:
    """Make the directory of a plan, or take up the one that is there.

    ValueError where it holds something else, another definition or, unless resume, anything.
    """
    held = [one.name for one in path.iterdir() if not is_remains(one.name, (ABOUT,))]
    if held and ABOUT not in held:
        raise ValueError(
            f"{path} holds {', '.join(sorted(held)[:5])}, but no race; accepted: a new directory"
        )
    if held and not resume:
        raise ValueError(
            f"{path} exists and is not empty; accepted: a new directory, or --resume (resume=True) "
            "to go on with the race in it"
        )
    if held:
        _require_same(path, plan)
        return
    (path / DATA).mkdir(exist_ok=True)
    write_whole(path / ABOUT, json_text(about(plan)))


def about(plan: RacePlan) -> dict[str, Foreign]:
    """What a race's directory and table say of it."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "digest": plan.digest,
        "definition": plan.definition,
        "begun": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "versions": versions(LIBRARIES),
    }


def read_about(path: Path) -> dict[str, Foreign]:
    """What a directory's race is. ValueError naming the file where there is none, or damaged."""
    file = path / ABOUT
    try:
        with refusing("it"):
            found = require_format(parse_json(read_text(file), "it"), FORMAT, VERSION, "a race")
            if not (isinstance(found.get("definition"), dict) and found.get("digest")):
                raise RefusedError("it has no definition")
            return found
    except ValueError as error:
        raise ValueError(f"{file}: {error}; accepted: the directory of a race") from error


def missing_runs(path: Path, plan: RacePlan) -> list[int]:
    """The runs that are not there. ValueError naming a file that is damaged or foreign."""
    return missing_of(path, len(plan.tasks), partial(require_chunk, digest=plan.digest), "race")


def task_files(path: Path) -> list[Path]:
    """The files of the runs in a race's directory. ValueError where it is none."""
    read_about(path)
    found = sorted(one for one in (path / DATA).iterdir() if CHUNK.fullmatch(one.name))
    if not found:
        raise ValueError(f"{path} has no run yet; accepted: a race that has one")
    return found


def run_path(path: Path, index: int) -> Path:
    """Where a run lies."""
    return chunk_path(path, index)


def _require_same(path: Path, plan: RacePlan) -> None:
    found = read_about(path)
    if found["digest"] == plan.digest:
        return
    mine, theirs = plan.definition, found["definition"]
    differing = [name for name in mine if mine[name] != theirs.get(name)] or ["its own entries"]
    raise ValueError(
        f"{path} was begun with other {', '.join(differing)}; accepted: to resume without "
        "changing it, or a new directory"
    )
