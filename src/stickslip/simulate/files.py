"""Rows with units into a CSV or Parquet file, by its ending; no digit is lost in either."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.records.files import write_whole, writing

if TYPE_CHECKING:
    from stickslip.records.table import Table

TABLES = (".csv", ".parquet")


def table_path(text: str, overwrite: bool) -> Path:
    """Path of a table. ValueError for another kind, a folder, a file that is not to be replaced;
    the package that writes Parquet is imported now, not when everything is computed."""
    from stickslip.agents.view_files import require_new, require_suffix

    path = Path(text)
    require_suffix(path, TABLES)
    if path.is_dir():
        raise ValueError(f"{path} is a directory; accepted: the path of a file")
    require_new([path], overwrite)
    if path.suffix.lower() == ".parquet":
        import pyarrow.parquet  # noqa: F401
    return path


def write_table(path: Path, table: Table, overwrite: bool) -> Path:
    """Write it whole. CSV: units in the head, numbers as Python shows them, None and NaN empty.
    Parquet: units in the columns' metadata, None as null."""
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
