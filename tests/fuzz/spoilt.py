"""Damaged, truncated and hostile files and archives, each from a seed."""

import io
import json
import struct
import zipfile
from collections.abc import Callable, Sequence

import numpy as np

METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
Members = dict[str, bytes]


def members_of(raw: bytes) -> Members:
    """An archive's entries."""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def archive_of(members: Members, method: int = zipfile.ZIP_STORED) -> bytes:
    """An archive of the entries."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
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


def flip(raw: bytes, rng: np.random.Generator) -> bytes:
    """Up to 30 bytes changed."""
    array = np.frombuffer(raw, np.uint8).copy()
    at = rng.integers(len(array), size=int(rng.integers(1, 31)))
    array[at] ^= rng.integers(1, 256, size=len(at), dtype=np.uint8)
    return array.tobytes()


def cut(raw: bytes, rng: np.random.Generator) -> bytes:
    """The first part."""
    return raw[: int(rng.integers(len(raw)))]


def shuffle(raw: bytes, rng: np.random.Generator) -> bytes:
    """A block left out, doubled or blanked."""
    low, high = sorted(rng.integers(len(raw), size=2))
    block = (b"", raw[low:high] * 2, bytes(high - low))[int(rng.integers(3))]
    return raw[:low] + block + raw[high:]


def flip_compressed(raw: bytes, rng: np.random.Generator) -> bytes:
    """Compressed in one of all ways, then flipped."""
    return flip(archive_of(members_of(raw), METHODS[int(rng.integers(4))]), rng)


def lie(raw: bytes, rng: np.random.Generator) -> bytes:
    """A field of the archive's directory changed: sizes, flags, method, offsets."""
    array, at = bytearray(raw), raw.find(b"PK\x01\x02")
    entries = []
    while at >= 0:
        entries.append(at)
        at = raw.find(b"PK\x01\x02", at + 1)
    entry = entries[int(rng.integers(len(entries)))]
    field, size = ((8, 2), (10, 2), (20, 4), (24, 4), (28, 2), (42, 4))[int(rng.integers(6))]
    value = (0, 1, 2**31, 2 ** (8 * size) - 1, int(rng.integers(2 ** (8 * size))))
    chosen = value[int(rng.integers(5))] % 2 ** (8 * size)
    array[entry + field : entry + field + size] = chosen.to_bytes(size, "little")
    return bytes(array)


def bomb(raw: bytes, rng: np.random.Generator) -> bytes:
    """An entry of many zeros, whose declared size is sometimes small."""
    members = members_of(raw)
    name = str(rng.choice(list(members)))
    head = members[name][:128]
    packed = archive_of(members | {name: head + bytes(30_000_000)}, zipfile.ZIP_DEFLATED)
    if rng.integers(2):
        return packed
    real, small = struct.pack("<I", 30_000_000 + len(head)), struct.pack("<I", 256)
    return packed.replace(real, small)


HEADERS: tuple[Callable[[np.random.Generator], bytes], ...] = (
    lambda rng: b"-" * int(rng.integers(1, 60_000)),
    lambda rng: b"(" * int(rng.integers(1, 60_000)),
    lambda rng: b"{'descr':" + b"[" * int(rng.integers(1, 9_000)),
    lambda rng: rng.bytes(int(rng.integers(1, 400))),
    *(
        lambda rng, descr=descr, shape=shape: (
            b"{'descr': %s, 'fortran_order': False, 'shape': %s, }" % (descr, shape)
        )
        for descr in (b"'<f4'", b"'|O'", b"'<U999999999'", b"'|V0'", b"'<M8[s]'", b"[('a', 'O')]")
        for shape in (b"()", b"(7,)", b"(-7,)", b"(9999999999999,)", b"(0, 99999)", b"(2,)*9**9")
    ),
)


def head(raw: bytes, rng: np.random.Generator) -> bytes:
    """An array's header as NumPy never writes it."""
    members = members_of(raw)
    name = str(rng.choice(list(members)))
    text = HEADERS[int(rng.integers(len(HEADERS)))](rng) + b"\n"
    size = struct.pack("<H", len(text))
    return archive_of(members | {name: b"\x93NUMPY\x01\x00" + size + text + members[name][128:]})


EXTREME = (0.0, -0.0, 1e-45, -1e-45, 1e-38, 1.2e-38, 3.4e38, -3.4e38, np.inf, -np.inf, np.nan, 1e19)


def numbers(raw: bytes, rng: np.random.Generator) -> bytes:
    """Some numbers of an array made extreme, in its own type or in float64."""
    members = members_of(raw)
    names = [name for name in members if not name.startswith(("metadata", "structure"))]
    name = str(rng.choice(names))
    array = np.load(io.BytesIO(members[name]), allow_pickle=False).copy()
    if rng.integers(2) and array.dtype.kind == "f":
        array = array.astype(float)
    if array.dtype.kind == "f" and array.size:
        at = rng.integers(array.size, size=int(rng.integers(1, array.size + 1)))
        value = EXTREME[int(rng.integers(len(EXTREME)))] * (1.0 if rng.integers(2) else 1e200)
        with np.errstate(all="ignore"):
            array.flat[at] = value
    file = io.BytesIO()
    np.save(file, array, allow_pickle=False)
    return archive_of(members | {name: file.getvalue()})


VALUES: tuple[Callable[[np.random.Generator], str], ...] = (
    *(
        lambda rng, text=text: text
        for text in (
            "null",
            "true",
            "[]",
            "{}",
            '""',
            "-1",
            "0",
            "1e39",
            "1e-46",
            "NaN",
            "Infinity",
            "1e999",
            '"\\ud800"',
            '"\\u0000"',
            "[[1, 2], 3]",
            "1.5",
            '"tanh"',
            "[7, 5, 4, 1]",
            "[7, 99999999, 1]",
        )
    ),
    lambda rng: "9" * int(rng.integers(1, 9_000)),
    lambda rng: "[" * (n := int(rng.integers(1, 3_000))) + "]" * n,
    lambda rng: "[" + "[]," * int(rng.integers(1, 200_000)) + "[]]",
    lambda rng: '{"a":' * (n := int(rng.integers(1, 3_000))) + "1" + "}" * n,
    lambda rng: json.dumps("x" * int(rng.integers(1, 2_000_000))),
    lambda rng: '"' + '\\"' * int(rng.integers(1, 300_000)),
)


def text_of(entry: bytes) -> str:
    """The text that an array holds."""
    return str(np.load(io.BytesIO(entry), allow_pickle=False))


def array_of(text: str) -> bytes:
    """The array that holds a text."""
    file = io.BytesIO()
    np.save(file, np.array(text), allow_pickle=False)
    return file.getvalue()


def spoil_json(text: str, rng: np.random.Generator) -> str:
    """One entry of an object, at any depth, replaced, dropped or renamed; or characters changed."""
    if rng.integers(4) == 0:
        return flip(text.encode(), rng).decode("utf-8", "surrogateescape")
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
        value = place.pop(key)
        if rng.integers(2):
            place[str(key) + "s"] = value
        return json.dumps(content)
    place[key] = mark
    value = VALUES[int(rng.integers(len(VALUES)))](rng)
    return json.dumps(content).replace(json.dumps(mark), value)


def metadata(raw: bytes, rng: np.random.Generator) -> bytes:
    """The archive's JSON text spoilt."""
    members = members_of(raw)
    name = "metadata.npy" if "metadata.npy" in members else "structure.npy"
    text = spoil_json(text_of(members[name]), rng)
    return archive_of(members | {name: array_of(text.encode("utf-8", "replace").decode())})


WAYS = (cut, flip, shuffle, flip_compressed, lie, head, numbers, metadata, bomb)
SHARES = np.array([2, 3, 2, 3, 3, 3, 3, 5, 0.3])


def spoil(raw: bytes, seed: int) -> tuple[str, bytes]:
    """What was done to an archive, and what came of it."""
    rng = np.random.default_rng(seed)
    way = WAYS[int(rng.choice(len(WAYS), p=SHARES / SHARES.sum()))]
    return way.__name__, way(raw, rng)
