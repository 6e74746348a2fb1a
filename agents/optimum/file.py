"""Values of dynamic programming in a file, to resume from; digests of what they belong to."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.value_iteration import Values
from stickslip.agents.untrusted import RefusedError, pack, read_bytes, refusing, unpack
from stickslip.records.files import write_whole

LARGEST = 512 * 2**20
"""Bytes of a file."""


@dataclass(frozen=True)
class Checkpoint:
    """A file of the values after some sweeps. definition: digest of task, grid and actions."""

    path: Path
    definition: str
    nodes: int

    def write(self, now: Values) -> None:
        """Write the values atomically."""
        content = {"definition": self.definition, "sweeps": now.sweeps}
        write_whole(self.path, pack({**content, "value": np.asarray(now.value)}))

    def read(self) -> Values | None:
        """The values in the file; None where there is none.

        ValueError, naming the file, for one that is damaged or of another definition.
        """
        if not self.path.exists():
            return None
        try:
            with refusing("it"):
                content = unpack(read_bytes(self.path, LARGEST), LARGEST)
                if content.get("definition") != self.definition:
                    raise RefusedError("it is of another task, grid or set of actions")
                value, sweeps = content["value"], int(content["sweeps"])
                if value.shape != (self.nodes,) or sweeps < 0 or not np.all(np.isfinite(value)):
                    raise RefusedError("its values are no finite numbers, one for each node")
                return Values(jnp.asarray(value), sweeps)
        except ValueError as error:
            raise ValueError(
                f"{self.path}: {error}; accepted: what an earlier run of the same task, grid and "
                "actions wrote there, or a new path"
            ) from error


def digest_of(*parts: object) -> str:
    """Digest of static things by their repr and of pytrees by structure and numbers."""
    found = hashlib.sha256()
    for part in parts:
        leaves, structure = jax.tree.flatten(part)
        found.update(repr(structure).encode())
        for leaf in leaves:
            if isinstance(leaf, jax.Array | np.ndarray | np.generic | float | int):
                array = np.asarray(leaf)
                found.update(f"{array.dtype} {array.shape}".encode())
                found.update(array.tobytes())
            else:
                found.update(repr(leaf).encode())
    return found.hexdigest()
