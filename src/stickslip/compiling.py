"""Saying that programs are compiled, where that takes long enough to wonder."""

from __future__ import annotations

from contextlib import contextmanager
from threading import Lock, Timer, get_ident
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

COMPILED = "/jax/core/compile/backend_compile_duration"
"""JAX's event: a number when a compilation begins, a duration when it ends."""
PATIENCE = 2.0
"""Compiling for less, all programs together, is not worth a line [s]."""


@contextmanager
def said_when_compiling(say: Callable[[], None], patience: float | None = None) -> Iterator[None]:
    """Inside, `say` is called once: as soon as JAX has compiled for `patience` [s] in all, by
    default PATIENCE.

    A program that is read from JAX's cache counts with the time that this takes. `say` may be
    called in another thread.
    """
    from jax import monitoring

    watch = _Watch(say, PATIENCE if patience is None else patience)
    monitoring.register_scalar_listener(watch.begun)
    monitoring.register_event_duration_secs_listener(watch.ended)
    try:
        yield
    finally:
        monitoring.unregister_scalar_listener(watch.begun)
        monitoring.unregister_event_duration_listener(watch.ended)
        watch.stop()


class _Watch:
    """Adds up how long is compiled, in every thread."""

    def __init__(self, say: Callable[[], None], patience: float):
        self._say, self._left, self._said = say, patience, False
        self._running: dict[int, Timer] = {}
        self._lock = Lock()

    def begun(self, event: str, value: Any, **_: Any) -> None:
        """A compilation begins: wait for its end only as long as patience lasts."""
        if event == COMPILED and not self._said:
            timer = Timer(max(self._left, 0.0), self._tell)
            timer.daemon = True
            self._running[get_ident()] = timer
            timer.start()

    def ended(self, event: str, duration_secs: float, **_: Any) -> None:
        """A compilation has ended."""
        if event == COMPILED and not self._said:
            if timer := self._running.pop(get_ident(), None):
                timer.cancel()
            self._left -= duration_secs
            if self._left <= 0:
                self._tell()

    def stop(self) -> None:
        """Say nothing any more."""
        self._said = True
        for timer in list(self._running.values()):
            timer.cancel()

    def _tell(self) -> None:
        with self._lock:
            first, self._said = not self._said, True
        if first:
            self._say()
