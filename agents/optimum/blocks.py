"""Keeping the transitions that are computed so far, block by block, in a folder of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stickslip.agents.training.checkpoint import pack, unpack
from stickslip.agents.untrusted import LARGEST, RefusedError, Rule, read_bytes, refusing
from stickslip.dynamics.checks import shown
from stickslip.optim.dynamic_programming.outcomes import STOPS, Block
from stickslip.records.files import PARTIAL, write_whole

FORMAT, VERSION = "stickslip transitions", 1
SUFFIX = ".transitions"
COUNT = Rule(int, "transitions", low=0)


class KeptBlocks:
    """A file for each block, beside a checkpoint of values, whole or not there.

    definition: of task, grid and actions. nodes: of the grid. It takes as much of the disk as the
    transitions take of memory, and one block of memory more.
    """

    def __init__(self, checkpoint: Path, definition: str, nodes: int):
        self.folder = checkpoint.with_name(checkpoint.name + SUFFIX)
        self.definition, self.nodes = definition, nodes

    def read(self, number: int, shape: tuple[int, int, int], kind: np.dtype) -> Block | None:
        """The block of that number; None where there is none. shape: nodes, actions and rank.

        ValueError, naming the file, for one that is damaged or of another definition.
        """
        path = self._path(number)
        if not path.exists():
            return None
        try:
            with refusing("it"):
                content = unpack(read_bytes(path, LARGEST), LARGEST)
                return self._block(content, number, shape, kind)
        except ValueError as error:
            raise ValueError(
                f"{path}: {error}; accepted: what an earlier run of the same task, grid and "
                "actions wrote there, or no file"
            ) from error

    def write(self, number: int, block: Block) -> None:
        """Keep a block."""
        self.folder.mkdir(parents=True, exist_ok=True)
        content = {"format": FORMAT, "version": VERSION, "definition": self.definition}
        write_whole(self._path(number), pack({**content, "number": number, **block._asdict()}))

    def discard(self) -> None:
        """Delete the blocks, and the folder where it holds nothing else."""
        if not self.folder.is_dir():
            return
        for path in self.folder.iterdir():
            if path.name.removesuffix(PARTIAL).removesuffix(".npz").isdigit():
                path.unlink()
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _path(self, number: int) -> Path:
        return self.folder / f"{number:09d}.npz"

    def _block(
        self, content: dict, number: int, shape: tuple[int, int, int], kind: np.dtype
    ) -> Block:
        if content.get("format") != FORMAT or content.get("version") != VERSION:
            raise RefusedError("it does not say that it holds transitions")
        if (content.get("definition"), content.get("number")) != (self.definition, number):
            raise RefusedError("it is of another task, grid, set of actions or place")
        wanted = {
            "base": (shape[:2], np.dtype(np.int32)),
            "share": (shape, kind),
            "reward": (shape[:2], kind),
        }
        for name, (size, dtype) in wanted.items():
            given = content.get(name)
            if not isinstance(given, np.ndarray) or (given.shape, given.dtype) != (size, dtype):
                raise RefusedError(f"its {name} is {shown(given)}, no {dtype} array of {size}")
        base = content["base"]
        if np.any((base < STOPS) | (base >= self.nodes)) or not np.all(
            np.isfinite(content["share"]) & np.isfinite(content["reward"])[..., None]
        ):
            raise RefusedError("it leads nowhere, or holds what is no number")
        counts = {name: COUNT.require(name, content.get(name)) for name in ("ended", "outside")}
        return Block(*(content[name] for name in wanted), **counts)
