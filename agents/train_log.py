"""TensorBoard's files, without repeating what a resumption repeats."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from torch.utils.tensorboard import SummaryWriter

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


class TensorBoard:
    """Scalars under a group's name. What an earlier process wrote beyond step `upto` is hidden.

    Each process writes its own file, as TensorBoard expects.
    """

    def __init__(self, directory: Path, upto: int = 0):
        self._writer = SummaryWriter(str(directory), purge_step=upto + 1 if upto else None)

    def add(self, group: str, timesteps: int, row: Mapping[str, float]) -> None:
        """Write the finite numbers of a row."""
        for name, value in row.items():
            if math.isfinite(value):
                self._writer.add_scalar(f"{group}/{name}", value, timesteps)

    def __enter__(self) -> TensorBoard:
        return self

    def __exit__(self, *error: object) -> None:
        self._writer.close()
