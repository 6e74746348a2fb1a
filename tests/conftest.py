"""Fixtures for every test: both precisions in one process, reference values, no display.

Precision: JAX decides it when an array is made, so ask for `dtype` (or `float64`) as a fixture and
make the arrays inside the test; an array made at module level is always float32.
"""

import ctypes
import gc
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

# Before jax, matplotlib or pygame is imported: tests need neither an accelerator nor a display.
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
# Stable-Baselines3 makes a folder for its log, also where it logs nothing, at every `learn`.
os.environ.setdefault("SB3_LOGDIR", tempfile.gettempdir())

# Tests compile the same programs over and over: new functions, other files, commands in processes
# of their own. All processes of a run share what they have compiled, in a folder that goes with the
# run. JAX would lock the folder to keep it below a size, and look at every file at every write.
os.environ.setdefault(
    "JAX_COMPILATION_CACHE_DIR", f"{tempfile.gettempdir()}/stickslip-programs-{os.getpid()}"
)
os.environ.setdefault("JAX_COMPILATION_CACHE_MAX_SIZE", "-1")
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0.05"  # whoever started us says less
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "0")

import hypothesis
import jax
import jax.numpy as jnp
import pytest

from stickslip.records.files import write_whole
from tests.extras import (  # noqa: F401  (pytest finds its hooks here)
    pytest_pycollect_makemodule,
    pytest_runtest_call,
    pytest_runtest_setup,
)

# Traced programs are many small objects that stay: looking through all of them for garbage as often
# as Python does by default takes a twentieth of the time.
gc.set_threshold(100_000, 50, 100)

DROPPING = "test_operations.py"
"""It drops all that is compiled, as the files with xla_defaults do."""
LONGEST = ("test_wheel.py", "test_examples.py")
"""Files of few and dear tests, of which two would otherwise begin when the others end."""

REFERENCE = Path(__file__).parent / "reference"

# The same examples on every machine; no deadline, since the first example of a shape compiles.
# The precision fixtures set a context for the whole test, which suits every example of it.
hypothesis.settings.register_profile(
    "stickslip",
    deadline=None,
    derandomize=True,
    max_examples=50,
    suppress_health_check=[
        hypothesis.HealthCheck.function_scoped_fixture,
        hypothesis.HealthCheck.differing_executors,
    ],
)
hypothesis.settings.load_profile("stickslip")


class Shared(jax._src.lru_cache.LRUCache):
    """JAX's folder of compiled programs, which appear there whole: the processes do without a lock.
    As JAX's own, so that the processes that tests start find them, too."""

    def put(self, key: str, value: bytes) -> None:
        with suppress(OSError):
            write_whole(self.path / f"{key}-cache", value)


jax._src.compilation_cache.LRUCache = Shared  # type: ignore[misc]
# jax has read it: from here on it is for the processes that tests start, which may read the folder
# and do not write there.
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "1e9"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that drop all that is compiled, while there is nothing to drop, and then
    with those that take long, or one process is alone with them at the end."""

    def place(item: pytest.Item) -> int:
        if "xla_defaults" in getattr(item, "fixturenames", ()) or item.path.name == DROPPING:
            return 0
        return 1 if item.path.name in LONGEST else 2

    items.sort(key=place)  # stable: else as they were


def pytest_unconfigure() -> None:
    """Leave no programs behind; a worker's own folder does not exist."""
    own = f"{tempfile.gettempdir()}/stickslip-programs-{os.getpid()}"
    shutil.rmtree(own, ignore_errors=True)


@pytest.fixture(autouse=True)
def _x64_is_the_callers_switch() -> Iterator[None]:
    """Start every test in float32, and fail one that leaves the global precision changed."""
    with jax.enable_x64(False):
        yield
    if jax.config.read("jax_enable_x64"):
        jax.config.update("jax_enable_x64", False)
        pytest.fail("the test, or what it imports, switched jax_enable_x64 on for the process")


MOST_MEMORY = 0.3
"""Of the machine's, that a process may hold before it drops what it has compiled: there are two."""
MOST_MAPS = 40_000
"""Memory maps of a process, likewise: past the 65,530 that Linux allows the compiler crashes."""


@pytest.fixture(scope="module", autouse=True)
def _programs_have_room() -> Iterator[None]:
    """Drop compiled programs between files, but only where they take too much: tracing and
    compiling them again for other files takes a third of all the time, dropping them 6 seconds.

    What was compiled from, which nobody needs afterwards, is a third of what is held and goes
    first, with what the compiler has freed and the C library keeps. Little else is garbage before:
    looking for it would take as long as dropping all.
    """
    yield
    if not _has_room():
        jax._src.interpreters.pxla._cached_lowering_to_hlo.cache_clear()
        _give_back()
    if not _has_room():
        jax.clear_caches()
        gc.collect()
        _give_back()


def _has_room() -> bool:
    """Whether there is room for the next file's programs; true where nobody tells."""
    held, maps = Path("/proc/self/statm"), Path("/proc/self/maps")
    if not (held.exists() and maps.exists()):
        return True
    resident = int(held.read_text().split()[1])
    too_much = MOST_MEMORY * os.sysconf("SC_PHYS_PAGES")
    return resident < too_much and maps.read_bytes().count(b"\n") < MOST_MAPS


def _give_back() -> None:
    """Have the C library return what it keeps of freed memory, where it can."""
    library = ctypes.CDLL(None)
    if hasattr(library, "malloc_trim"):
        library.malloc_trim(0)


@pytest.fixture(scope="module")
def xla_defaults() -> Iterator[None]:
    """Compile a file's programs with XLA's defaults, as users do, also where `make test` asks for
    quicker compiling: programs that differ have the same bits with the defaults only."""
    from jax._src import compiler

    asked = compiler.get_compile_options

    def as_users_do(*args: Any, env_options_overrides: Any = None, **kwargs: Any) -> Any:
        given = {
            "xla_backend_optimization_level": 3,
            "xla_cpu_use_fusion_emitters": True,
            "xla_cpu_parallel_codegen_split_count": 32,
            "xla_disable_hlo_passes": "",
        }
        flags = os.environ.get("XLA_FLAGS", "")  # what it names, XLA knows
        given = {name: value for name, value in given.items() if name in flags}
        overrides = given | (env_options_overrides or {})
        return asked(*args, env_options_overrides=overrides, **kwargs)

    jax.clear_caches()
    compiler.get_compile_options = as_users_do
    yield
    compiler.get_compile_options = asked
    jax.clear_caches()


@pytest.fixture(params=["float32", "float64"])
def dtype(request: pytest.FixtureRequest) -> Iterator[jnp.dtype]:
    """Run the test in float32 and again in float64.

    Promotion is strict: arrays of different types do not mix (Python numbers mix with all), so a
    float64 result proves that no float32 array took part.
    """
    with jax.enable_x64(request.param == "float64"), jax.numpy_dtype_promotion("strict"):
        yield jnp.dtype(request.param)


@pytest.fixture
def float64() -> Iterator[jnp.dtype]:
    """Run the test in float64 only: comparisons with tight tolerances."""
    with jax.enable_x64(True):
        yield jnp.dtype("float64")


@pytest.fixture(scope="session")
def reference() -> dict[str, Any]:
    """Values of the default biped from independent derivations; "about" says what they are."""
    return json.loads((REFERENCE / "biped_default.json").read_text(encoding="utf-8"))


@pytest.fixture
def mass() -> Iterator[None]:
    """Register a third machine, the mass of tests/agents/mass.py."""
    from stickslip.agents import machine
    from tests.agents.mass import MassMachine

    machine.register(MassMachine())
    yield
    del machine._MACHINES["mass"]


@pytest.fixture
def empty_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the test in an empty directory."""
    monkeypatch.chdir(tmp_path)
