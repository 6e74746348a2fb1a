"""Results of a step, read from the rows of numbers that the compiled step returns."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Array


def ending(info: Mapping[str, float], terminated: bool) -> str:
    """Description of an episode's end; info: of its last step."""
    how = "terminated" if terminated else "truncated"
    count = info.get("episode_length")
    length = "" if count is None else f" after {count} step{'' if count == 1 else 's'}"
    status = f", status {Status(int(info['status'])).name}" if "status" in info else ""
    return how + length + status


class Columns:
    """Columns of the numbers of `row_of` in the result of an environment's step."""

    def __init__(self, obs: Array, info: dict[str, Array]):
        """Columns of one environment, unbatched; shapes and types suffice."""
        self.width = obs.shape[0]
        """Numbers of an observation."""
        names = sorted(set(info) - {"final_obs", "autoreset"})
        self.entries = {name: np.dtype(info[name].dtype) for name in names}
        """Entries of info, with their types."""
        self.count = 2 * self.width + 4 + len(names)
        """Numbers of a row."""
        self._not_real = [
            (name, bool if kind.kind == "b" else int)
            for name, kind in self.entries.items()
            if kind.kind != "f"
        ]

    def one(self, row: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, float]]:
        """Values of Gymnasium's step, from one environment's row."""
        numbers = row.tolist()
        reward, terminated, truncated, _ = numbers[2 * self.width : 2 * self.width + 4]
        obs = row[: self.width].astype(np.float32)
        return obs, reward, terminated != 0, truncated != 0, self._info(numbers)

    def info_of(self, row: np.ndarray) -> dict[str, float]:
        """Info of one environment, in Python's numbers."""
        return self._info(row.tolist())

    def _info(self, numbers: list[float]) -> dict[str, float]:
        info: dict[str, float] = dict(zip(self.entries, numbers[2 * self.width + 4 :], strict=True))
        for name, kind in self._not_real:
            info[name] = kind(info[name])
        return info


class Results:
    """One step of a batch of n environments, from the rows of `row_of` [n, numbers].

    reward, terminated, truncated, autoreset: [n]; what else there is, when it is asked for.
    """

    def __init__(self, table: np.ndarray, columns: Columns):
        self._table, self._columns, width = table, columns, columns.width
        self.reward = table[:, 2 * width]
        flags = table[:, 2 * width + 1 : 2 * width + 4] != 0
        self.terminated, self.truncated, self.autoreset = flags.T

    @property
    def obs(self) -> np.ndarray:
        """[n, obs]"""
        return self._table[:, : self._columns.width].copy()

    @property
    def final_obs(self) -> np.ndarray:
        """[n, obs]"""
        return self._table[:, self._columns.width : 2 * self._columns.width]

    @cached_property
    def info(self) -> dict[str, np.ndarray]:
        """A column [n] for each entry."""
        columns = self._table.T[2 * self._columns.width + 4 :]
        return {
            name: column.astype(kind, copy=False)
            for column, (name, kind) in zip(columns, self._columns.entries.items(), strict=True)
        }

    def info_of(self, index: int) -> dict[str, float]:
        """Info of one environment, in Python's numbers."""
        return self._columns.info_of(self._table[index])
