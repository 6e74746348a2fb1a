"""Files and text of a simulation: a table by its ending, a picture's path, a summary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.envs.rendering.animation import require_format
from stickslip.envs.rendering.extras import require
from stickslip.records.files import (
    require_new,
    require_suffix,
    require_writable,
    write_whole,
    writing,
)

if TYPE_CHECKING:
    from stickslip.records.table import Table
    from stickslip.simulate.flags import Output

TABLES = (".csv", ".parquet")
STATUS = {
    "OK": "the whole time was walked",
    "SLIP_ONSET": "the whole time was walked; the foot slipped",
    "TOPPLE": "it falls: the zero-moment point leaves the foot",
    "LIFT_OFF": "it falls: the ground would have to pull at the foot",
    "RUNAWAY": "the crank turns faster than the greatest rate that was given",
    "NO_SOLUTION": "the equations have no unique solution here (Painlevé), or the linkage does not "
    "close",
    "NON_FINITE": "a number overflowed or is none, the torque's perhaps",
    "STEP_COMPLETE": "the one step was walked to the exchange of support",
    "NO_EXCHANGE": "support cannot be handed over without an impact",
    "NOT_CONVERGED": "the integrator's steps are too few or too long; the numbers end there",
    "HOLLOW_GROUND": "the ground is hollower than a wheel",
    "ROLLOVER": "it rolls over: the ground would have to pull at a wheel",
    "GROUNDED": "the body or a leg touches the ground",
    "WHEEL_SLIP": "a wheel slips: it needs more friction than there is",
    "OVERLOAD": "a wheel needs more torque than its motor gives",
    "OVERLAP": "the wheels overlap: the legs are folded too far",
}
"""Meaning of each Status for a simulation."""


LONGEST_FILM = 600.0
"""Seconds of motion."""


def output_paths(out: str, files: Output, seconds: float) -> tuple[Path, Path | None, Path | None]:
    """Paths of the table, the picture and the film of so many seconds.

    ValueError for another kind, a folder, a file that is not to be replaced, a film that is too
    long; the packages that write Parquet and pictures are imported now, not when everything is
    computed.
    """
    path = Path(out)
    require_suffix(path, TABLES)
    if path.is_dir():
        raise ValueError(f"{path} is a directory; accepted: the path of a file")
    if path.suffix.lower() == ".parquet":
        import pyarrow.parquet  # noqa: F401
    picture, film = (None if name is None else Path(name) for name in (files.plot, files.film))
    if picture is not None:
        require_suffix(picture, (".png",))
        require("matplotlib.figure")
    if film is not None:
        require_format(film)
        if seconds > LONGEST_FILM:
            raise ValueError(f"--film of {seconds:g} s; accepted: up to {LONGEST_FILM:g} s")
        if film == picture:
            raise ValueError(f"--film {film} with --plot {picture}; accepted: two files")
    written = [one for one in (path, picture, film) if one is not None]
    require_new(written, files.overwrite)
    require_writable(written)
    return path, picture, film


def write_table(path: Path, table: Table, overwrite: bool) -> Path:
    """Write it whole; no digit is lost.

    CSV: units in the head, numbers as Python shows them, None and NaN empty. Parquet: units in the
    columns' metadata, None as null.
    """
    if path.suffix.lower() == ".csv":
        return write_whole(path, table.csv(), overwrite=overwrite)
    import pyarrow as pa
    from pyarrow import parquet

    columns = zip(*table.rows, strict=True) if table.rows else [()] * len(table.columns)
    arrays = [pa.array(list(values)) for values in columns]
    fields = [
        pa.field(column.name, array.type, metadata={"unit": column.unit})
        for column, array in zip(table.columns, arrays, strict=True)
    ]
    with writing(path, overwrite=overwrite) as file:
        parquet.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), file)
    return path


def print_summary(summary: Table, promise: str | None = None) -> None:
    """Print a line a number, with its unit; None is left out."""
    width = max(len(column.name) for column in summary.columns)
    for column, value in zip(summary.columns, summary.rows[0], strict=True):
        if value is not None:
            unit = "" if column.unit == "-" else f" {column.unit}"
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
            print(f"{column.name.replace('_', ' '):<{width}}  {text}{unit}")
    if promise is not None:
        print(f"{'promise':<{width}}  {promise}")
