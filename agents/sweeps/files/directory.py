"""The directory of a sweep: what it is, which of its chunks are there, who may write."""

from __future__ import annotations

import platform
import re
import subprocess
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, cast

from stickslip.agents.foreign.reading import (
    RefusedError,
    parse_json,
    read_text,
    refusing,
    require_format,
)
from stickslip.agents.sweeps.files.parquet import require_chunk
from stickslip.agents.sweeps.plan import Layout
from stickslip.dynamics.checks import shown
from stickslip.records.files import PARTIAL, discard, is_remains, put_aside, write_whole
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.sweeps.definition import AxisEntry, Definition, Whole
    from stickslip.agents.sweeps.plan import Plan

FORMAT, VERSION = "stickslip sweep", 1
ABOUT, DATA = "sweep.json", "data"
PRODUCT = re.compile(r"summary\.txt|report\.html|(sweep|endings)(-\d+)?\.png")
"""Names of what is made of the results at the end; of several tasks a picture for each."""
CHUNK = re.compile(r"chunk-(\d{6})\.parquet")
MOST_CHUNKS = 10**6
"""What six digits number."""
PACKAGES = ("stickslip", "jax", "jaxlib", "numpy", "scipy", "pyarrow", "distributed")


@dataclass(frozen=True)
class About:
    """What a sweep's directory says of itself: sweep.json."""

    definition: Definition
    digest: str
    layout: Layout
    chunks: int
    units: dict[str, str]
    finished: tuple[str, ...]
    """What summaries have of the episodes alone that did not fall."""
    drawn: tuple[str, ...] | None = None
    """The tasks whose resets draw; None where the file does not say."""

    @property
    def axes(self) -> dict[str, AxisEntry]:
        """Their entries of the definition, by name."""
        return self.definition["axes"]


def open_sweep(path: Path, plan: Plan, *, resume: bool, overwrite: bool, chunk: int | None) -> Plan:
    """Make the directory of a plan that is cut, or take up the one that is there.

    Return the plan, cut as it was when it was begun. ValueError where the directory holds something
    else, another definition or, unless one of `resume` and `overwrite` is asked for, anything.
    """
    if resume and overwrite:
        raise ValueError("resume and overwrite exclude each other; accepted: one of them")
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; accepted: a directory for the sweep")
    held = (
        [one for one in path.iterdir() if not is_remains(one.name, (ABOUT,))]
        if path.exists()
        else []
    )
    if held and not (path / ABOUT).exists():
        names = ", ".join(sorted(one.name for one in held)[:5])
        raise ValueError(f"{path} holds {names}, but no sweep; accepted: a new directory")
    if held and resume:
        about = read_about(path)
        require_same(path, about, plan)
        if chunk is not None and plan.layout.chunk_points != about.layout.chunk_points:
            raise ValueError(
                f"chunk = {chunk}, but {path} was begun with chunks of "
                f"{about.layout.chunk_points * plan.episodes}; accepted: to resume without it"
            )
        return replace(plan, layout=about.layout)
    if held and not overwrite:
        raise ValueError(
            f"{path} exists and is not empty; accepted: a new directory, --resume to go on with "
            "the sweep in it, or --overwrite to begin it anew"
        )
    if held:
        _clear(path)
    (path / DATA).mkdir(parents=True, exist_ok=True)
    write_whole(path / ABOUT, json_text(_content(plan)))
    return plan


def read_about(path: str | Path) -> About:
    """What a directory's sweep is. ValueError naming the file where there is none, or damaged."""
    file = Path(path) / ABOUT
    try:
        with refusing("it"):
            found = require_format(parse_json(read_text(file), "it"), FORMAT, VERSION, "a sweep")
            content = cast("Whole", found)
            layout = Layout(*(int(content["layout"][name]) for name in Layout._fields))
            definition, units = content["definition"], dict(content["units"])
            if not (isinstance(definition["axes"], dict) and definition["cases"]):
                raise RefusedError("its definition has no axes or cases")
            finished = tuple(map(str, content.get("finished", ())))  # none in version 0.2.0
            count = int(content["chunks"])
            if not 0 < count <= MOST_CHUNKS:
                raise RefusedError(f"it has {count} chunks")
            known = content.get("drawn")
            drawn = None if known is None else tuple(map(str, known))
            digest = str(content["digest"])
            return About(definition, digest, layout, count, units, finished, drawn)
    except ValueError as error:
        raise ValueError(f"{file}: {error}; accepted: the directory of a sweep") from error


def require_same(path: Path, about: About, plan: Plan) -> None:
    """Raise ValueError saying what differs where the directory holds another sweep."""
    if about.digest == plan.digest:
        return
    raise ValueError(
        f"{path} was begun with another definition: {', '.join(_differing(about, plan))}; "
        "accepted: to resume without changing it, or a new directory"
    )


def chunk_path(path: str | Path, index: int) -> Path:
    """Where a chunk lies."""
    return Path(path) / DATA / f"chunk-{index:06d}.parquet"


def missing_chunks(path: Path, plan: Plan) -> list[int]:
    """The chunks that are not there. ValueError naming a file that is damaged or foreign."""
    each = 1 if plan.summaries else plan.episodes

    def whole(file: Path, index: int) -> None:
        chunk = plan.chunks[index]
        require_chunk(file, index, plan.digest, (chunk.last - chunk.first) * each)

    return missing_of(path, len(plan.chunks), whole)


def missing_of(
    path: Path, count: int, whole: Callable[[Path, int], None], what: str = "sweep"
) -> list[int]:
    """The numbers, below `count`, whose files are not there; whole: raises for a damaged one."""
    folder, missing = path / DATA, []
    folder.mkdir(exist_ok=True)
    for one in folder.iterdir():
        if is_remains(one.name, _Names(CHUNK)):
            one.unlink()  # a killed process left it half written
        elif not (found := CHUNK.fullmatch(one.name)) or int(found[1]) >= count:
            raise ValueError(f"{one} is no chunk of the {what} in {path}; accepted: its own alone")
    for index in range(count):
        file = chunk_path(path, index)
        if file.exists():
            whole(file, index)
        else:
            missing.append(index)
    return missing


class _Names:
    """All names that a pattern matches."""

    def __init__(self, pattern: re.Pattern[str]):
        self._pattern = pattern

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._pattern.fullmatch(name) is not None


def _content(plan: Plan) -> dict[str, object]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "digest": plan.digest,
        "definition": plan.definition,
        "layout": plan.layout._asdict(),
        "chunks": len(plan.chunks),
        "episodes": plan.total,
        "units": plan.units | plan.kept_units,
        "finished": list(plan.finished),
        "drawn": list(plan.drawn),
        "begun": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "versions": versions(),
    }


def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """What it is computed with. more: packages besides PACKAGES."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in (*PACKAGES, *more):
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def commit() -> str | None:
    """Of the package's own checkout, where it lies in one."""
    here = Path(__file__)
    git = ["git", "-C", str(here.parent)]
    try:
        for command in (["ls-files", "--error-unmatch", here.name], ["rev-parse", "HEAD"]):
            found = subprocess.run(
                [*git, *command], capture_output=True, text=True, check=True, timeout=10
            )
    except (OSError, subprocess.SubprocessError):
        return None
    return found.stdout.strip() or None


def _differing(about: About, plan: Plan) -> list[str]:
    """Which entries of two definitions differ, by dotted names."""
    found = []
    for name in sorted({*about.definition, *plan.definition}):
        one, other = about.definition.get(name), plan.definition.get(name)
        if one == other:
            continue
        if isinstance(one, dict) and isinstance(other, dict):
            inner = sorted(key for key in {*one, *other} if one.get(key) != other.get(key))
            found += [f"{name} {shown(key)}" for key in inner]
        elif isinstance(one, int | str) and isinstance(other, int | str):
            found.append(f"{name} {one}, not {other}")
        else:
            found.append(name)
    return found or ["its own entries do not belong to its digest"]


def _clear(path: Path) -> None:
    """Delete what a sweep wrote, and refuse a directory that holds anything else."""
    read_about(path)
    chunks, products = _Names(CHUNK), _Names(PRODUCT)
    names = [one.name for one in path.iterdir() if one.name not in (ABOUT, DATA, DATA + PARTIAL)]
    foreign = [
        one
        for one in names
        if one not in products and not is_remains(one, products) and not is_remains(one, (ABOUT,))
    ]
    if (path / DATA).is_dir():
        held = (one.name for one in (path / DATA).iterdir())
        foreign += [one for one in held if one not in chunks and not is_remains(one, chunks)]
    if foreign:
        raise ValueError(
            f"{path} also holds {', '.join(sorted(foreign)[:5])}, which no sweep wrote; accepted: "
            "a directory with a sweep alone"
        )
    if (path / DATA).is_dir():
        discard(put_aside(path / DATA))
    for name in names:
        (path / name).unlink(missing_ok=True)
    (path / ABOUT).unlink()  # last: until then it is a sweep, and can be cleared again
