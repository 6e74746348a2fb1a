"""One palette for many pictures."""

from __future__ import annotations

import numpy as np

from stickslip.envs.rendering.extras import require

EXACT = 96
"""How many of the most frequent colours are kept exactly."""
COLOURS = 255
"""The 256th palette entry stays free for "as before"."""
UNKNOWN = COLOURS
SAMPLE = 65536


class PaletteCount:
    """How often each colour occurs in the frames seen so far, from every third row."""

    def __init__(self):
        self._colours = np.empty(0, np.uint32)
        self._times = np.empty(0, np.int64)

    def add(self, frame: np.ndarray) -> None:
        """Count a frame's colours, uint8 [height, width, 3]."""
        colours, times = np.unique(_pack(frame[::3]), return_counts=True)
        everything = np.concatenate([self._colours, colours])
        self._colours, place = np.unique(everything, return_inverse=True)
        weights = np.concatenate([self._times, times])
        self._times = np.bincount(place, weights).astype(np.int64)

    def palette(self) -> np.ndarray:
        """Up to 255 colours, uint8 [n, 3]: the commonest as they are, the rest by median cut.

        Rare colours count with the square root of their number, so that a thin line or a badge
        that seldom shows keeps its colour beside large even areas.
        """
        Image = require("PIL.Image")
        order = np.argsort(-self._times, kind="stable")
        colours = _unpack(self._colours[order])
        if len(colours) <= COLOURS:
            return colours
        exact, rest = colours[:EXACT], colours[EXACT:]
        weight = np.sqrt(self._times[order[EXACT:]])
        copies = np.ceil(weight * (SAMPLE / weight.sum())).astype(int)
        sample = Image.fromarray(np.repeat(rest, copies, axis=0)[None])
        cut = sample.quantize(COLOURS - EXACT, method=Image.Quantize.MEDIANCUT)
        entries = np.array(cut.getpalette(), np.uint8).reshape(-1, 3)
        return np.concatenate([exact, entries])[:COLOURS]


class Indexer:
    """Turns pictures into palette entries: for each pixel the nearest colour, without dithering.

    Each colour is looked for once; a table of all 2^24 colours keeps what was found.
    """

    def __init__(self, palette: np.ndarray):
        self._palette = palette.astype(np.float32)
        self._table = np.full(1 << 24, UNKNOWN, np.uint8)

    def __call__(self, frame: np.ndarray) -> np.ndarray:
        """uint8 [height, width, 3] to uint8 [height, width]."""
        packed = _pack(frame)
        entries = self._table[packed]
        missing = np.unique(packed[entries == UNKNOWN])
        for start in range(0, len(missing), 4096):
            some = missing[start : start + 4096]
            self._table[some] = self._nearest(_unpack(some).astype(np.float32))
        return self._table[packed] if missing.size else entries

    def _nearest(self, colours: np.ndarray) -> np.ndarray:
        # |c - p|^2 without |c|^2, which is the same for every entry
        distance = np.sum(self._palette**2, axis=1) - 2 * colours @ self._palette.T
        return np.argmin(distance, axis=1).astype(np.uint8)


def _pack(frame: np.ndarray) -> np.ndarray:
    red, green, blue = np.moveaxis(frame.astype(np.uint32), -1, 0)
    return (red << 16) | (green << 8) | blue


def _unpack(colours: np.ndarray) -> np.ndarray:
    return np.stack([colours >> 16, (colours >> 8) & 255, colours & 255], -1).astype(np.uint8)
