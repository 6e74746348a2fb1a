"""Damaged, truncated and hostile files and archives, each from a seed."""

import io
import json
import zipfile
from collections.abc import Callable, Sequence

import numpy as np

Members = dict[str, bytes]
PIECES = (b"\0", b"\xff" * 8, b"PK\x01\x02", b"\x93NUMPY", b"{}", b"[" * 10_000, b"1e999", b"NaN",
          b"null", b"-1", b'"', b"9" * 5000, b"\n", b"../../etc")  # fmt: skip


def members_of(raw: bytes) -> Members:
    """An archive's entries."""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def archive_of(members: Members) -> bytes:
    """An archive of the entries."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def mutated(whole: bytes, pieces: Sequence[bytes], random: np.random.Generator) -> bytes:
    """The bytes with one to four cuts, swaps, flips, repetitions or insertions."""
    raw = bytearray(whole)
    for _ in range(random.integers(1, 5)):
        a, b = sorted(random.integers(0, len(raw) + 1, 2))
        b = min(b, a + int(random.integers(1, 60)))
        kind = random.integers(7)
        if kind == 0:
            del raw[a:]
        elif kind == 1:
            del raw[a:b]
        elif kind == 2:
            raw[a:a] = pieces[random.integers(len(pieces))]
        elif kind == 3:
            raw[a:a] = raw[a:b]
        elif kind == 4 and len(raw):
            raw[min(a, len(raw) - 1)] ^= 1 << int(random.integers(8))
        elif kind == 5:
            raw[a:b] = bytes(random.integers(0, 256, b - a, dtype=np.uint8))
        else:
            raw[a:b] = raw[a:b][::-1]
    return bytes(raw)


def array_bytes(array: np.ndarray) -> bytes:
    """The array as an entry of an archive."""
    file = io.BytesIO()
    np.save(file, array, allow_pickle=False)
    return file.getvalue()


EXTREME = (0.0, -0.0, 1e-45, -1e-45, 1e-38, 1.2e-38, 3.4e38, -3.4e38, np.inf, -np.inf, np.nan, 1e19)


def numbers(raw: bytes, rng: np.random.Generator) -> bytes:
    """Some numbers of an array made extreme, in its own type or in float64."""
    members = members_of(raw)
    name = str(rng.choice([name for name in members if name != "metadata.npy"]))
    array = np.load(io.BytesIO(members[name]), allow_pickle=False).copy()
    if rng.integers(2) and array.dtype.kind == "f":
        array = array.astype(float)
    if array.dtype.kind == "f" and array.size:
        at = rng.integers(array.size, size=int(rng.integers(1, array.size + 1)))
        extreme = EXTREME[int(rng.integers(len(EXTREME)))] * (1.0 if rng.integers(2) else 1e200)
        with np.errstate(all="ignore"):
            array.flat[at] = extreme
    return archive_of(members | {name: array_bytes(array)})


VALUES = ["null", "true", "[]", "{}", '""', "-1", "1e39", "NaN", "1e999", '"\\ud800"', '"\\u0000"']
LONG: tuple[Callable[[int], str], ...] = (
    lambda n: "9" * n,
    lambda n: "[" * n + "]" * n,
    lambda n: "[" + "[]," * 60 * n + "[]]",
    lambda n: '{"a":' * n + "1" + "}" * n,
    lambda n: json.dumps("x" * 600 * n),
)


def value(rng: np.random.Generator) -> str:
    """JSON that stands for nothing, or is deep or long."""
    texts = [*VALUES, *(long(int(rng.integers(1, 3_000))) for long in LONG)]
    return texts[int(rng.integers(len(texts)))]


def spoil_json(text: str, rng: np.random.Generator) -> str:
    """One entry of an object, at any depth, replaced, dropped or renamed; or characters changed."""
    if rng.integers(4) == 0:
        return mutated(text.encode(), PIECES, rng).decode("utf-8", "surrogateescape")
    content = json.loads(text)
    place = content
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = keys[int(rng.integers(len(keys)))]
        if isinstance(place[key], dict | list) and place[key] and rng.integers(3):
            place = place[key]
            continue
        break
    mark = "a place that stands nowhere else"
    if isinstance(place, dict) and rng.integers(4) == 0:
        renamed = place.pop(key)
        if rng.integers(2):
            place[str(key) + "s"] = renamed
        return json.dumps(content)
    place[key] = mark
    return json.dumps(content).replace(json.dumps(mark), value(rng))


def metadata(raw: bytes, rng: np.random.Generator) -> bytes:
    """The archive's JSON text spoilt."""
    members = members_of(raw)
    array = np.load(io.BytesIO(members["metadata.npy"]), allow_pickle=False)
    text = spoil_json(str(array), rng).encode("utf-8", "replace").decode()
    return archive_of(members | {"metadata.npy": array_bytes(np.array(text))})


def bytes_changed(raw: bytes, rng: np.random.Generator) -> bytes:
    """Any bytes cut, swapped, flipped, repeated or inserted."""
    return mutated(raw, PIECES, rng)


WAYS = (bytes_changed, numbers, metadata)


def spoil(raw: bytes, seed: int) -> tuple[str, bytes]:
    """What was done to an archive, and what came of it."""
    rng = np.random.default_rng(seed)
    way = WAYS[int(rng.integers(len(WAYS)))]
    return way.__name__, way(raw, rng)
