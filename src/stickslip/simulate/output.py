"""Files and text of a simulation: a table by its ending, a picture's path, a summary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

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
    from collections.abc import Callable

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


class Files(NamedTuple):
    """Paths of the rows, the plot and the film; None for none."""

    table: Path
    plot: Path | None
    film: Path | None
    overwrite: bool

    @classmethod
    def of(cls, given: Output, seconds: float) -> Files:
        """The paths that are asked for; seconds: of the film.

        ValueError for another kind, a folder, a file that is not to be replaced, a film that is too
        long. The packages that write them are imported now, not when everything is computed.
        """
        table = Path(given.out)
        plot, film = (None if one is None else Path(one) for one in (given.plot, given.film))
        require_suffix(table, TABLES)
        if table.is_dir():
            raise ValueError(f"{table} is a directory; accepted: the path of a file")
        if table.suffix.lower() == ".parquet":
            import pyarrow.parquet  # noqa: F401
        if plot is not None:
            require_suffix(plot, (".png",))
            require("matplotlib.figure")
        if film is not None:
            require_format(film)
            if seconds > LONGEST_FILM:
                raise ValueError(f"--film of {seconds:g} s; accepted: up to {LONGEST_FILM:g} s")
            if film == plot:
                raise ValueError(f"--film {film} with --plot {plot}; accepted: two files")
        written = [one for one in (table, plot, film) if one is not None]
        require_new(written, given.overwrite)
        require_writable(written)
        return cls(table, plot, film, given.overwrite)

    def write(
        self, table: Table, plot: Callable[[Path], object], film: Callable[[Path], object]
    ) -> list[str]:
        """Write the files that are asked for, say which, and return their names."""
        write_table(self.table, table, self.overwrite)
        for path, draw in ((self.plot, plot), (self.film, film)):
            if path is not None:
                draw(path)
        written = [str(one) for one in self[:3] if one is not None]
        print(f"Written: {', '.join(written)}")
        return written


def write_table(path: Path, table: Table, overwrite: bool) -> None:
    """Write it whole; no digit is lost.

    CSV: units in the head, numbers as Python shows them, None and NaN empty. Parquet: units in the
    columns' metadata, None as null.
    """
    if path.suffix.lower() == ".csv":
        write_whole(path, table.csv(), overwrite=overwrite)
        return
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
