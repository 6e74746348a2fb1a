"""Compiled programs that the command line keeps from one command to the next.

They are JAX's: its compilation cache writes and reads them. JAX writes them in place, never looks
whether they are whole, and needs a lock (and a package more) to keep their folder below a size; a
writer that is killed at the wrong moment spoils the folder for good. So each command works in a
folder of its own: it begins with links to what is kept and verified, and what is new there at its
end is moved, whole, to the others. What is kept is machine code: a folder that others may write to
is not used.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import shutil
import sys
import time
import warnings
import zlib
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.compiling import said_when_compiling
from stickslip.optim.progress import say_stage

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

FOLDER = "STICKSLIP_CACHE"
"""Environment variable: the folder to keep programs in, or OFF."""
OFF = "off"
LARGEST = 128 * 2**20
"""All programs kept, of all versions and machines [bytes]; beyond, the oldest go."""
SHORTEST = 0.1
"""Least compile time of a kept program [s]."""
FORGOTTEN = 30 * 24 * 3600.0
"""When a working folder without an owner goes, where it cannot be seen whether it has one [s]."""
SUFFIX = "-cache"
"""Of JAX's files."""
KEPT = re.compile(r"([0-9a-f]{32})\.(.+-cache)")
"""Digest of the content, JAX's name."""
WORKING = re.compile(r"\.use-(.*)-(\d+)-[0-9a-f]{8}")
"""Host and process of a working folder."""
TROUBLE = "Error (reading|writing) persistent compilation cache entry"


@contextmanager
def compiled_programs(keep: bool = True) -> Iterator[None]:
    """Inside, JAX finds the programs that earlier commands compiled, and stderr is told when new
    ones take long.

    Nothing is kept with keep=False, where the user has set a cache of JAX's, where STICKSLIP_CACHE
    is "off" and where no folder of the user's can be written; that is never an error.
    """
    import jax

    config: Any = jax.config
    own = bool(config.jax_compilation_cache_dir)
    folder = None
    if keep and not own and not _crashes(sys.platform):
        folder = programs_folder(os.environ, sys.platform)
    store = None if folder is None else _prepared(folder)

    def say() -> None:
        once = " (the next time they are there)" if store or own else ""
        say_stage(f"compiling programs{once}")

    with said_when_compiling(say):
        if store is None:
            yield
            return
        with kept_programs(store):
            yield


def programs_folder(environment: Mapping[str, str], system: str) -> Path | None:
    """Folder of the user's kept programs, or None: the cache folder of the system's kind."""
    if asked := environment.get(FOLDER):
        return None if asked.lower() == OFF else Path(asked)
    if system == "win32":
        local = environment.get("LOCALAPPDATA")
        return Path(local) / "stickslip" / "Cache" if local else None
    home = environment.get("HOME")
    if system == "darwin":
        return Path(home) / "Library" / "Caches" / "stickslip" if home else None
    shared = environment.get("XDG_CACHE_HOME", "")
    if os.path.isabs(shared):
        return Path(shared) / "stickslip"
    return Path(home) / ".cache" / "stickslip" if home else None


@contextmanager
def kept_programs(store: Path) -> Iterator[None]:
    """Inside, JAX reads the programs in a folder, and new ones are there at the end."""
    import jax
    from jax.experimental.compilation_cache import compilation_cache

    work = store / f".use-{_host()}-{os.getpid()}-{secrets.token_hex(4)}"
    settings: dict[str, Any] = {
        "jax_compilation_cache_dir": str(work),
        "jax_compilation_cache_max_size": -1,
        "jax_persistent_cache_enable_xla_caches": "none",  # their path would be in every key
    }
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        settings["jax_persistent_cache_min_compile_time_secs"] = SHORTEST
    before = {name: getattr(jax.config, name) for name in settings}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", TROUBLE)
        try:
            with suppress(OSError):
                _lay_out(store, work)
            for name, value in settings.items():
                jax.config.update(name, value)
            compilation_cache.reset_cache()
            yield
        finally:
            for name, value in before.items():
                jax.config.update(name, value)
            compilation_cache.reset_cache()
            with suppress(OSError):
                _publish(store, work)
            shutil.rmtree(work, ignore_errors=True)
            with suppress(OSError):
                _shrink(store.parent)


def _crashes(system: str) -> bool:
    """True if kept programs are known to end a process: on macOS before jaxlib 0.10."""
    import jaxlib

    return system == "darwin" and tuple(map(int, jaxlib.__version__.split(".")[:2])) < (0, 10)


def _prepared(folder: Path) -> Path | None:
    """The folder of this machine's programs, fit to be used, or None."""
    try:
        store = folder / f"programs-{_machine()}"
        for one in (folder, store):
            one.mkdir(parents=True, exist_ok=True, mode=0o700)
            if hasattr(os, "getuid"):
                about = one.stat()
                if about.st_uid != os.getuid() or about.st_mode & 0o022:
                    return None
        _clear_away(store)
    except OSError:
        return None
    return store


def _machine() -> str:
    """Machine code is for one kind of processor and one jaxlib."""
    import jax
    import jaxlib

    parts = [platform.system(), platform.machine(), platform.processor()]
    parts += [jax.__version__, jaxlib.__version__]
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        told = ("model name", "flags", "Features", "CPU part")
        parts += sorted({line for line in lines if line.startswith(told)})
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _host() -> str:
    return re.sub(r"[^\w.-]", "_", platform.node())[:64]


def _lay_out(store: Path, work: Path) -> None:
    """A working folder with everything that is kept and still is what it was."""
    work.mkdir(mode=0o700)
    for path in store.iterdir():
        if not (found := KEPT.fullmatch(path.name)):
            continue
        with suppress(OSError):  # another process has just dropped it, or linked one like it
            if _digest(path.read_bytes()) != found[1]:
                path.unlink()
            else:
                _link(path, work / found[2])


def _link(path: Path, name: Path) -> None:
    try:
        os.link(path, name)
    except FileExistsError:
        path.unlink()  # the same program, compiled by two processes at once
    except OSError:  # a file system without links
        shutil.copyfile(path, name)


def _publish(store: Path, work: Path) -> None:
    """Move the whole programs that are new to the others."""
    known = {found[2] for path in store.iterdir() if (found := KEPT.fullmatch(path.name))}
    for path in work.iterdir():
        if path.name.endswith(SUFFIX) and path.name not in known:
            content = path.read_bytes()
            if _is_whole(content):
                os.replace(path, store / f"{_digest(content)}.{path.name}")


def _is_whole(content: bytes) -> bool:
    """True if JAX wrote it to its end: a full disk cuts it short."""
    try:
        if not content.startswith(b"\x28\xb5\x2f\xfd"):
            zlib.decompress(content)
        elif sys.version_info >= (3, 14):
            from compression import zstd

            zstd.decompress(content)
        else:
            import zstandard  # pyright: ignore[reportMissingImports]

            zstandard.ZstdDecompressor().decompress(content)
    except Exception:  # noqa: BLE001, each of them has its own
        return False
    return True


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def _clear_away(store: Path) -> None:
    """Delete the working folders of processes that are gone.

    Such a process was killed, or died of a program that it read: nothing of what it may have read
    is read again.
    """
    for work in store.glob(".use-*"):
        found = WORKING.fullmatch(work.name)
        here = found and found[1] == _host() and os.name == "posix"
        owner = int(found[2]) if found and here else None
        if owner is not None and not _runs(owner):
            for path in store.iterdir():
                if KEPT.fullmatch(path.name):
                    path.unlink(missing_ok=True)
        elif here or time.time() - work.stat().st_mtime < FORGOTTEN:
            continue
        shutil.rmtree(work, ignore_errors=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _shrink(folder: Path) -> None:
    """Delete the oldest programs of all machines beyond LARGEST."""
    kept = []
    for path in folder.glob("programs-*/*"):
        with suppress(OSError):
            if KEPT.fullmatch(path.name):
                about = path.stat()
                kept.append((about.st_mtime, about.st_size, path))
    total = sum(size for _, size, _ in kept)
    for _, size, path in sorted(kept):
        if total <= LARGEST:
            return
        path.unlink(missing_ok=True)
        total -= size
