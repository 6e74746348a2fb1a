"""JAX's compilation cache for the command line, guarded, and a line when compiling takes long.

JAX writes its files in place and never looks whether they are whole. Here each begins with the
digest of the rest and is renamed into place; one whose digest differs is dropped and compiled
again. Files are machine code: a folder that others may write to is not used.
"""

from __future__ import annotations

import hashlib
import os
import platform
import time
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Any

from stickslip.optim.progress import say_stage
from stickslip.records.files import PARTIAL, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

FOLDER = "STICKSLIP_CACHE"
"""Environment variable: the folder to keep programs in, or OFF."""
OFF = "off"
LARGEST = 128 * 2**20
"""All programs kept, of all versions and machines [bytes]; beyond, the oldest go."""
SHORTEST = 0.1
"""Least compile time of a kept program [s]."""
ABANDONED = 3600.0
"""Age of a partial file whose writer was killed [s]."""
DIGEST = 32
"""Bytes of a file's digest."""
COMPILED = "/jax/core/compile/backend_compile_duration"
"""JAX's event: a number when a compilation begins, a duration when it ends."""
PATIENCE = 2.0
"""Duration of a compilation that is worth a line [s]."""


@contextmanager
def compiled_programs(keep: bool = True) -> Iterator[None]:
    """Inside, JAX finds the programs that earlier commands compiled, and stderr is told when one
    takes long.

    Nothing is kept with keep=False, where the user has set a cache of JAX's, where STICKSLIP_CACHE
    is "off" and where no folder of the user's can be written; that is never an error.
    """
    import jax

    config: Any = jax.config
    own = bool(config.jax_compilation_cache_dir)
    folder = programs_folder(os.environ) if keep and not own else None
    store = None if folder is None else prepared(folder)
    again = " (the next time they are there)" if store or own else ""
    with said_when_compiling(lambda: say_stage(f"compiling programs{again}")):
        if store is None:
            yield
        else:
            with kept_programs(store):
                yield


def programs_folder(environment: Mapping[str, str]) -> Path | None:
    """Folder of the user's kept programs, or None where there is to be none."""
    asked = environment.get(FOLDER, "")
    if asked.lower() == OFF:
        return None
    shared, home = environment.get("XDG_CACHE_HOME", ""), os.path.expanduser("~/.cache")
    found = Path(asked or os.path.join(shared if os.path.isabs(shared) else home, "stickslip"))
    return found if asked or found.is_absolute() else None


def prepared(folder: Path) -> Path | None:
    """The folder of this machine's programs, fit to be used, or None."""
    store = folder / f"programs-{_machine()}"
    try:
        for one in (folder, store):
            one.mkdir(parents=True, exist_ok=True, mode=0o700)
            about = one.stat()
            if hasattr(os, "getuid") and (about.st_uid != os.getuid() or about.st_mode & 0o022):
                return None
    except OSError:
        return None
    return store


def _machine() -> str:
    """Digest of the kind of processor and the versions of JAX: machine code is for one of each."""
    import jax
    import jaxlib

    parts = [platform.system(), platform.machine(), platform.processor()]
    parts += [jax.__version__, jaxlib.__version__]
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        about = ("model name", "flags", "Features", "CPU part")
        parts += sorted({line for line in lines if line.startswith(about)})
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


@contextmanager
def kept_programs(store: Path) -> Iterator[None]:
    """Inside, JAX reads programs from a folder and writes new ones there."""
    import jax
    from jax._src import compilation_cache

    settings: dict[str, Any] = {
        "jax_compilation_cache_dir": str(store),
        "jax_compilation_cache_max_size": -1,
        "jax_persistent_cache_enable_xla_caches": "none",  # their path would be in every key
    }
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        settings["jax_persistent_cache_min_compile_time_secs"] = SHORTEST
    before = {name: getattr(jax.config, name) for name in settings}
    unguarded = compilation_cache.LRUCache
    try:
        for name, value in settings.items():
            jax.config.update(name, value)
        compilation_cache.LRUCache = checked_files()
        compilation_cache.reset_cache()
        yield
    finally:
        for name, value in before.items():
            jax.config.update(name, value)
        compilation_cache.LRUCache = unguarded
        compilation_cache.reset_cache()
        with suppress(OSError):
            shrink(store.parent)


def checked_files() -> type:
    """JAX's file cache with files that are written atomically and checked when they are read."""
    from jax._src.lru_cache import LRUCache

    class CheckedFiles(LRUCache):
        def get(self, key: str) -> bytes | None:
            path = self.path / f"{key}-cache"
            with suppress(OSError):
                content = path.read_bytes()
                if _digest(content[DIGEST:]) == content[:DIGEST]:
                    return content[DIGEST:]
                path.unlink()
            return None

        def put(self, key: str, value: bytes) -> None:
            with suppress(OSError):
                write_whole(self.path / f"{key}-cache", _digest(value) + value)

    return CheckedFiles


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def shrink(folder: Path) -> None:
    """Delete the oldest programs of all machines beyond LARGEST, and what killed writers left."""
    kept = []
    for path in folder.glob("programs-*/*"):
        with suppress(OSError):
            about = path.stat()
            if path.name.endswith("-cache"):
                kept.append((about.st_mtime, about.st_size, path))
            elif path.name.endswith(PARTIAL) and time.time() - about.st_mtime > ABANDONED:
                path.unlink()
    total = sum(size for _, size, _ in kept)
    for _, size, path in sorted(kept):
        if total <= LARGEST:
            return
        path.unlink(missing_ok=True)
        total -= size


@contextmanager
def said_when_compiling(say: Callable[[], None]) -> Iterator[None]:
    """Inside, `say` is called once, in another thread, when JAX compiles a program for PATIENCE."""
    from jax import monitoring

    running: list[Timer] = []
    once = cache(say)

    def begun(event: str, value: Any, **_: Any) -> None:
        if event == COMPILED:
            timer = Timer(PATIENCE, once)
            timer.daemon = True
            running.append(timer)
            timer.start()

    def ended(event: str, duration_secs: float, **_: Any) -> None:
        if event == COMPILED and running:
            running.pop().cancel()

    monitoring.register_scalar_listener(begun)
    monitoring.register_event_duration_secs_listener(ended)
    try:
        yield
    finally:
        monitoring.unregister_scalar_listener(begun)
        monitoring.unregister_event_duration_listener(ended)
        for timer in running:
            timer.cancel()
