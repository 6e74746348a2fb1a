"""Reading .npz files that may come from anywhere: arrays of numbers and text, and nothing else."""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np

LARGEST = 64 * 2**20
"""Bytes that a file and its unpacked contents may have."""
BROKEN = (
    ValueError,
    SyntaxError,
    TypeError,
    KeyError,
    IndexError,
    EOFError,
    OverflowError,
    RecursionError,
    NotImplementedError,  # a compression that zipfile does not know
    RuntimeError,  # an encrypted entry
    OSError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading bytes that were not written as an .npz can raise."""


def read_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """Every array of an .npz file. ValueError, without the path, says what is wrong.

    Objects are refused (they would be pickles, which run code), and so is any array whose declared
    size is not that of its data, before memory is set aside for it.
    """
    try:
        with Path(path).open("rb") as file:
            raw = file.read(LARGEST + 1)
    except FileNotFoundError:
        raise ValueError("no such file") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"cannot be read ({error})") from error
    if len(raw) > LARGEST:
        raise ValueError(f"larger than {LARGEST} bytes")
    try:
        archive = zipfile.ZipFile(io.BytesIO(raw))
    except BROKEN as error:
        raise ValueError("no .npz archive, or cut short") from error
    with archive:
        members = archive.infolist()
        names = [member.filename for member in members]
        if foreign := [name for name in names if not name.endswith(".npy")]:
            raise ValueError(f"a foreign archive, with the entry {foreign[0]!r}")
        if len(set(names)) != len(names):
            raise ValueError("an archive with two entries of one name")
        if sum(member.file_size for member in members) > LARGEST:
            raise ValueError(f"unpacks to more than {LARGEST} bytes")
        return {name.removesuffix(".npy"): _read(archive, name) for name in names}


def _read(archive: zipfile.ZipFile, name: str) -> np.ndarray:
    try:
        file = io.BytesIO(archive.read(name))
        shape, fortran, dtype = _header(file)
    except BROKEN as error:
        raise ValueError(f"its entry {name!r} is damaged ({error})") from error
    if dtype.hasobject or dtype.names is not None:
        raise ValueError(f"its entry {name!r} holds objects ({dtype}), not numbers")
    data = file.read()
    if (
        dtype.itemsize == 0
        or math.prod(shape) * dtype.itemsize != len(data)
        or min(shape, default=0) < 0
    ):
        raise ValueError(f"its entry {name!r} declares {dtype} {shape} over {len(data)} bytes")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if fortran else "C")


def _header(file: io.BytesIO) -> tuple[tuple[int, ...], bool, np.dtype]:
    kind = np.lib.format.read_magic(file)
    if kind == (1, 0):
        return np.lib.format.read_array_header_1_0(file)
    if kind == (2, 0):
        return np.lib.format.read_array_header_2_0(file)
    raise ValueError(f"array format {kind}")
