"""Forms of `--torque`: a number, a file of times and torques, or arithmetic of the state."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_number, shown
from stickslip.optim.columns import ColumnSpec, accepted_table, read_columns
from stickslip.simulate.expression import ACCEPTED, Expression

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Float

FILES = (".csv", ".npy")
LONGEST_NAME = 255
"""Characters: what is longer is no file's name for any system."""
COLUMNS = (ColumnSpec("time", "s", ("t",)), ColumnSpec("torque", "N m", ("T", "tau", "M")))
OF_AN_ARRAY = "an .npy of [rows, 2], finite numbers, times [s] that increase, or a .csv, "
OF_A_FILE = OF_AN_ARRAY + accepted_table(COLUMNS)


@dataclass(frozen=True)
class Recorded:
    """Torques [N m] at times [s], straight between them."""

    name: str
    times: Float[np.ndarray, " n"]
    torques: Float[np.ndarray, " n"]

    @property
    def end(self) -> float:
        """The last time [s]."""
        return float(self.times[-1])

    def over(self, times: Float[np.ndarray, " m"], count: int) -> Float[np.ndarray, " m"]:
        """The torques at the first `count` times, and the last of these for the rest."""
        return self.at(np.minimum(times, times[count - 1]))

    def at(self, times: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        """The torques at other times. ValueError beyond the first and the last one."""
        slack = 1e-9 * max(1.0, abs(self.end))
        if self.times[0] > times[0] + slack or self.end < times[-1] - slack:
            raise ValueError(
                f"{self.name} has torques from {self.times[0]:g} to {self.end:g} s, and the walk "
                f"asks for them from {times[0]:g} to {times[-1]:g} s; accepted: a shorter walk "
                "(--seconds), or more of the file"
            )
        return np.interp(times, self.times, self.torques)


def torque_of(text: str, columns: Mapping[str, str] | None = None) -> float | Expression | Recorded:
    """A number [N m], what is in a file, or arithmetic.

    columns: of a .csv, time and torque -> head to take for it. ValueError for what is none of
    these, or a file that is damaged; OSError for one that cannot be opened.
    """
    path = Path(text)
    if columns and path.suffix.lower() != ".csv":
        raise ValueError(f"columns = {shown(columns)} with torque {shown(text)}; accepted: a .csv")
    try:
        number = float(text)
    except ValueError:
        number = None
    if number is not None:
        require_number("torque", number, accepted="a finite torque [N m]")
        return number
    if not text.strip():
        raise ValueError(f"the torque is empty; accepted: a number [N m], a file, or {ACCEPTED}")
    if path.suffix.lower() == ".csv":
        times, torques = read_columns(path, COLUMNS, columns, also=OF_AN_ARRAY).T
        return Recorded(str(path), times, torques)
    if path.suffix.lower() == ".npy":
        return Recorded(str(path), *_array(path).T)
    if len(text) < LONGEST_NAME and path.exists():
        raise ValueError(
            f"torque {shown(text)} is a {'folder' if path.is_dir() else 'file'}; accepted: a file "
            f"that ends in {' or '.join(FILES)}"
        )
    return Expression(text)


def _array(path: Path) -> Float[np.ndarray, "n 2"]:
    """Pairs from an .npy, times that increase; nothing of an object array is unpickled, and what
    the head says is held to the file's length before anything of that size exists."""
    try:
        laid = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise ValueError(f"{path}: {error}; accepted: {OF_A_FILE}") from None
    if laid.ndim != 2 or laid.shape[1] != 2 or not len(laid) or laid.dtype.kind not in "fiu":
        raise ValueError(f"{path} holds {laid.dtype} of shape {laid.shape}; accepted: {OF_A_FILE}")
    found = np.array(laid, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
    if bad.size:
        raise ValueError(
            f"{path}: row {int(bad[0]) + 1} is {found[bad[0]].tolist()}; accepted: {OF_A_FILE}"
        )
    wrong = np.flatnonzero(np.diff(found[:, 0]) <= 0)
    if wrong.size:
        i = int(wrong[0])
        raise ValueError(
            f"{path}: row {i + 2}: time = {found[i + 1, 0]} after {found[i, 0]} does not increase; "
            f"accepted: {OF_A_FILE}"
        )
    return found
