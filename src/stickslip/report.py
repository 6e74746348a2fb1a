"""Results of `simulate` and `optimise`: paths that are checked, numbers printed, files written."""

from argparse import Namespace
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TypeAlias

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.lazily import require
from stickslip.envs.rendering.animation import require_format
from stickslip.optim.progress import say_stage
from stickslip.records import files as paths
from stickslip.records.table import Column, Content, Table, json_text, with_unit

Maker: TypeAlias = "Callable[[Path], object]"
"""Writes a file to the path that it is given."""
RESULT = "result.json"
LONGEST_FILM = 600.0
"""Seconds of motion."""


def require_files(given: Namespace, seconds: float) -> None:
    """Refuse paths and films that cannot be written; seconds: of the film."""
    table, *others = Path(given.out), given.plot, given.film
    plot, film = (None if one is None else Path(one) for one in others)
    paths.require_suffix(table, (".csv",))
    if table.is_dir():
        raise ValueError(f"{table} is a directory; accepted: the path of a file")
    if plot is not None:
        paths.require_suffix(plot, (".png",))
        require("matplotlib.figure")
    if film is not None:
        require_format(film)
        if seconds > LONGEST_FILM:
            raise ValueError(f"--film of {seconds:g} s; accepted: up to {LONGEST_FILM:g} s")
        if film == plot:
            raise ValueError(f"--film {film} with --plot {plot}; accepted: two files")
    paths.require_writable([one for one in (table, plot, film) if one is not None], given.overwrite)


def picture_path(out: str | None, beside: Path, overwrite: bool) -> Path:
    """The path of a .png, by default beside a file; refuse one that cannot be drawn or written."""
    path = Path(out) if out else beside.with_suffix(".png")
    paths.require_suffix(path, (".png",))
    paths.require_writable([path], overwrite)
    require("matplotlib.figure")
    return path


def write_simulation(given: Namespace, table: Table, plot: Maker, film: Maker) -> list[str]:
    """Write the rows and the pictures that are asked for; return their names."""
    rows = partial(paths.write_whole, content=table.csv(), overwrite=given.overwrite)
    pairs = zip((given.out, given.plot, given.film), (rows, plot, film), strict=True)
    return write_files({Path(name): make for name, make in pairs if name is not None})


def result_folder(given: Namespace, default: str) -> Path:
    """The folder for a result; ValueError if something is there and may not be replaced."""
    out = Path(given.out or default)
    paths.require_folder(out)
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; accepted: a directory, or a new path, for --out")
    if not given.overwrite and out.is_dir() and any(out.iterdir()):
        raise ValueError(f"{out} exists; accepted: another --out, or --overwrite to replace")
    paths.require_makeable(out)
    if given.pictures:
        require("matplotlib.figure")
    return out


def write_result(
    given: Namespace,
    out: Path,
    tables: Mapping[str, Table],
    facts: dict[str, object],
    files: Mapping[str, Callable[[], bytes | str]],
    usual: Iterable[str],
    found: bool,
) -> Content:
    """Print and return a result; write its files into the folder, beside the facts in RESULT.

    usual: names of all that the command may write, of which no older one stays beside these.
    """
    show(*tables.values())
    files = {RESULT: lambda: json_text(facts)} | dict(files)
    if not given.pictures:
        files = {name: make for name, make in files.items() if not name.endswith(".png")}
    for name in {*usual, RESULT} - files.keys() if given.overwrite else ():
        (out / name).unlink(missing_ok=True)

    def maker(make: Callable[[], bytes | str]) -> Maker:
        return lambda path: paths.write_whole(path, make(), overwrite=given.overwrite)

    written = write_files({out / name: maker(make) for name, make in files.items()})
    return Content(tables, facts | {"files": written}, status=OK if found else NOTHING_FOUND)


def write_files(files: Mapping[Path, Maker]) -> list[str]:
    """Write files, say which, and return their names."""
    for path, make in files.items():
        if path.suffix != ".csv":
            say_stage(f"writing {path}")
        make(path)
    names = list(map(str, files))
    print(f"Written: {', '.join(names)}")
    return names


def one_row(columns: Mapping[Column, object]) -> Table:
    """A summary: a table of one row."""
    return Table(list(columns), [list(columns.values())])


def show(summary: Table, *others: Table) -> None:
    """Print a summary, a line a number that is not None, and then tables."""
    pairs = zip(summary.columns, summary.rows[0], strict=True)
    told = [(one, value) for one, value in pairs if value not in (None, "")]
    rows = [(one.name.replace("_", " "), with_unit(value, one.unit)) for one, value in told]
    columns = [Column("name", words=True), Column("value", words=True)]
    print(Table(columns, rows).terminal(head=False), end="")
    for table in others:
        print("\n" + table.rounded(6).terminal(), end="")
