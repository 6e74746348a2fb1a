"""JAX's compilation cache for the command line, with files that are checked.

JAX writes its files in place and never looks whether they are whole. Here each begins with the
digest of the rest and is renamed into place; one with another digest is deleted and compiled again.
Files are machine code: a folder that others may write to is not used.
"""

import hashlib
import os
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from stickslip.optim.progress import say_stage
from stickslip.records.files import write_whole

FOLDER = "STICKSLIP_CACHE"
"""Environment variable: the folder to keep programs in, or OFF."""
OFF = "off"
LARGEST = 128 * 2**20
"""All programs kept, of all versions and machines [bytes]; beyond, the oldest go."""
SHORTEST = 0.1
"""Least compile time of a kept program [s]."""
DIGEST = 32
"""Bytes of a file's digest."""


@contextmanager
def compiled_programs(keep: bool = True) -> Iterator[None]:
    """Inside, JAX finds the programs that earlier commands compiled.

    Nothing is kept with keep=False, where the user has set a cache of JAX's, where STICKSLIP_CACHE
    is "off" and where no folder of the user's can be written; that is never an error.
    """
    import jax

    config: Any = jax.config
    own = bool(config.jax_compilation_cache_dir)
    folder = programs_folder(os.environ) if keep and not own else None
    store = None if folder is None else prepared(folder)
    with nullcontext() if store is None else kept_programs(store):
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

    parts = [platform.machine(), platform.processor(), jax.__version__, jaxlib.__version__]
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        about = ("model name", "flags", "Features", "CPU part")
        parts += sorted({line for line in lines if line.startswith(about)})
    return _digest("\n".join(parts).encode()).hex()[:16]


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
        shrink(store.parent)


def checked_files() -> type:
    """JAX's file cache with files that are written atomically and checked when they are read."""
    from jax._src.lru_cache import LRUCache

    class CheckedFiles(LRUCache):
        said = False

        def get(self, key: str) -> bytes | None:
            path = self.path / f"{key}-cache"
            with suppress(OSError):
                content = path.read_bytes()
                if _digest(content[DIGEST:]) == content[:DIGEST]:
                    return content[DIGEST:]
                path.unlink()
            if not self.said and not any(self.path.iterdir()):
                self.said = True
                say_stage("compiling programs, which later commands reuse,")
            return None

        def put(self, key: str, value: bytes) -> None:
            with suppress(OSError):
                write_whole(self.path / f"{key}-cache", _digest(value) + value)

    return CheckedFiles


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def shrink(folder: Path) -> None:
    """Delete the oldest files of all machines beyond LARGEST."""
    total = 0
    with suppress(OSError):  # another command deletes at the same time
        found = [(one.stat(), one) for one in folder.glob("programs-*/*")]
        for about, path in sorted(found, key=lambda one: -one[0].st_mtime):
            total += about.st_size
            if total > LARGEST:
                path.unlink()
