"""Things known by name that are built when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

T = TypeVar("T")


class Built(Mapping[str, T]):
    """A mapping from name to thing. Each is built when it is asked for, so that its numbers have
    the precision that is then switched on; its name is known without JAX."""

    def __init__(self, builders: dict[str, Callable[[], T]]):
        self._builders = builders

    def __getitem__(self, name: str) -> T:
        return self._builders[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._builders)

    def __len__(self) -> int:
        return len(self._builders)
