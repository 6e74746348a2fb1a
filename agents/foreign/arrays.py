"""Reading .npz files that may come from anywhere: arrays of numbers and text, and nothing else.

Every size that a file declares is looked at before memory is set aside: number of entries and
their unpacked bytes in the archive's directory, shape and type in each array's header. NumPy then
reads the arrays, with pickles refused (they would run code).
"""

from __future__ import annotations

import io
import math
import re
import zipfile

import numpy as np

from stickslip.agents.foreign.reading import RefusedError, refusing

LARGEST = 64 * 2**20
"""Bytes that a file and its unpacked contents may have, unless the reader says otherwise."""
MOST_ENTRIES = 1024
ENTRY = b"PK\x01\x02"
"""Begins each entry of an archive's directory; by chance also stands in one array out of 10^8."""
KINDS = {"stored": zipfile.ZIP_STORED, "deflated": zipfile.ZIP_DEFLATED}
"""Compressions that NumPy writes."""
NUMBERS = ("<f4", "<f8", "<i4", "<i8", "<u4", "|u1", "|b1")
HEADER = re.compile(
    rb"\{'descr': '([<|][a-zA-Z]\d{1,9})', 'fortran_order': (?:True|False), "
    rb"'shape': \((\d{0,18}(?:, ?\d{1,18}){0,7}),?\), ?\} *\n"
)
"""Accepted beginnings of an array file of NumPy."""
LONGEST_HEADER = 512


def arrays_in(raw: bytes, largest: int = LARGEST) -> dict[str, np.ndarray]:
    """Every array of an .npz file's contents. RefusedError, a ValueError, says what is wrong.

    largest: bytes that the file and its unpacked contents may have. Accepted are little-endian
    numbers (NUMBERS) and text.
    """
    if len(raw) > largest:
        raise RefusedError(f"larger than {largest} bytes")
    if raw.count(ENTRY) > 2 * MOST_ENTRIES:
        raise RefusedError(f"an archive of more than {MOST_ENTRIES} entries")
    try:
        archive = zipfile.ZipFile(io.BytesIO(raw))
    except Exception as error:  # whatever bytes make of it
        raise RefusedError("no .npz archive, or cut short") from error
    with archive, refusing("the archive"):
        members = archive.infolist()
        _check_members(members, largest)
        return {one.filename.removesuffix(".npy"): _read(archive, one) for one in members}


def _check_members(members: list[zipfile.ZipInfo], largest: int) -> None:
    names = [member.filename for member in members]
    if foreign := [name for name in names if not name.endswith(".npy")]:
        raise RefusedError(f"a foreign archive, with the entry {foreign[0][:80]!r}")
    if len(set(names)) != len(names):
        raise RefusedError("an archive with two entries of one name")
    if len(names) > MOST_ENTRIES:
        raise RefusedError(f"an archive of more than {MOST_ENTRIES} entries")
    if sum(member.file_size for member in members) > largest:
        raise RefusedError(f"unpacks to more than {largest} bytes")
    for member in members:
        if member.compress_type not in KINDS.values():
            raise RefusedError(
                f"its entry {member.filename[:80]!r} is compressed by method "
                f"{member.compress_type}, not {' or '.join(KINDS)}"
            )


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    what = f"its entry {member.filename[:80]!r}"
    with refusing(what):
        with archive.open(member) as file:
            raw = file.read(member.file_size + 1)  # never more than declared
        data = _require_header(raw, what)
        array = np.lib.format.read_array(
            io.BytesIO(raw), allow_pickle=False, max_header_size=LONGEST_HEADER
        )
        if array.nbytes != data:
            raise RefusedError(f"{what} declares {array.nbytes} bytes over {data}")
        return array


def _require_header(raw: bytes, what: str) -> int:
    """Bytes of data behind an array's header, refused unless it declares as many."""
    if raw[:8] not in (b"\x93NUMPY\x01\x00", b"\x93NUMPY\x02\x00"):
        raise RefusedError(f"{what} is no array")
    width = 2 * raw[6]
    length = int.from_bytes(raw[8 : 8 + width], "little")
    header = raw[8 + width : 8 + width + min(length, LONGEST_HEADER)]
    found = HEADER.fullmatch(header)
    if found is None:
        objects = b"'|O'" in header or b"[(" in header
        raise RefusedError(
            f"{what} holds objects" if objects else f"the header of {what} is damaged"
        )
    descr, sizes = found.group(1).decode(), found.group(2).decode()
    if descr not in NUMBERS and not descr.startswith("<U"):
        raise RefusedError(
            f"{what} holds {'objects' if descr == '|O' else descr}; accepted: numbers"
        )
    shape = [int(size) for size in sizes.split(",") if size.strip()]
    declared = math.prod(shape) * np.dtype(descr).itemsize
    if declared != len(raw) - 8 - width - length or np.dtype(descr).itemsize == 0:
        raise RefusedError(
            f"{what} declares {descr} {tuple(shape)} over {len(raw) - 8 - width - length} bytes"
        )
    return declared
