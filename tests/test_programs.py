"""Programs kept for the next command: the same, whole, the user's alone, never in the way."""

import os
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip import programs
from stickslip.programs import compiled_programs, kept_programs, prepared, programs_folder

CONFIG: Any = jax.config


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder where even what compiles at once is kept."""
    monkeypatch.delenv("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", raising=False)
    monkeypatch.setattr(programs, "SHORTEST", 0.0)
    folder = tmp_path / "programs-here"
    folder.mkdir()
    return folder


def run(store: Path) -> tuple[bytes, int]:
    """A small program's result in a store, and how many programs were found there."""
    hits: list[str] = []

    def heard(event: str, **_: object) -> None:
        if event == "/jax/compilation_cache/cache_hits":
            hits.append(event)

    x = np.linspace(0.0, 1.0, 7, dtype=np.float32)
    jax.monitoring.register_event_listener(heard)
    try:
        with kept_programs(store):
            result = jax.jit(lambda x: jnp.sin(x) @ jnp.cos(x) + x)(x)
    finally:
        jax.monitoring.unregister_event_listener(heard)
    return np.asarray(result).tobytes(), len(hits)


def test_what_one_command_compiles_the_next_one_finds(store, capsys):
    before = CONFIG.jax_compilation_cache_dir
    first, hits = run(store)
    assert hits == 0
    assert run(store) == (first, 1)
    assert capsys.readouterr().err.count("compiling programs") == 1
    assert len(list(store.iterdir())) == 1
    assert CONFIG.jax_compilation_cache_dir == before


@pytest.mark.parametrize(
    "damage",
    [
        lambda raw: b"",
        lambda raw: raw[: len(raw) // 2],
        lambda raw: raw[:-1] + bytes([raw[-1] ^ 1]),
    ],
    ids=["empty", "cut", "last bit"],
)
def test_a_damaged_program_is_dropped_and_compiled_again(store, damage):
    first, _ = run(store)
    (path,) = store.iterdir()
    path.write_bytes(damage(path.read_bytes()))
    assert run(store) == (first, 0)
    assert run(store) == (first, 1)


def test_a_disk_that_takes_nothing_changes_nothing(store, monkeypatch):
    first, _ = run(store)
    (path,) = store.iterdir()
    path.unlink()

    def full(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(programs, "write_whole", full)
    assert run(store) == (first, 0)
    assert list(store.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="of POSIX systems")
def test_a_folder_that_others_may_write_to_or_that_is_none_is_not_used(tmp_path):
    folder = tmp_path / "cache"
    assert prepared(folder) is not None
    folder.chmod(0o777)
    assert prepared(folder) is None
    (tmp_path / "file").write_text("")
    assert prepared(tmp_path / "file" / "cache") is None


def test_the_oldest_go_where_there_are_too_many(store, monkeypatch):
    other = store.with_name("programs-of-an-older-version")
    other.mkdir()
    for age, path in enumerate([store / "b", other / "a", store / "c"]):
        name = path.with_name(f"{path.name}-cache")
        name.write_bytes(bytes(100))
        os.utime(name, (0, 1000 - age))
    monkeypatch.setattr(programs, "LARGEST", 200)
    programs.shrink(store.parent)
    assert {path.name for path in store.parent.glob("*/*")} == {"a-cache", "b-cache"}


def test_programs_lie_in_the_users_cache_folder():
    assert programs_folder({}) == Path.home() / ".cache" / "stickslip"
    assert programs_folder({"XDG_CACHE_HOME": "/fast"}) == Path("/fast/stickslip")
    assert programs_folder({"STICKSLIP_CACHE": "/mine"}) == Path("/mine")
    assert programs_folder({"STICKSLIP_CACHE": "OFF"}) is None


def test_a_cache_that_the_user_has_set_stays_as_it_is(tmp_path, monkeypatch):
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "mine"))
    before = CONFIG.jax_compilation_cache_dir
    try:
        for own, keep, used in (("jax", True, False), (None, False, False), (None, True, True)):
            given = own and str(tmp_path / own)
            jax.config.update("jax_compilation_cache_dir", given)
            with compiled_programs(keep):
                assert CONFIG.jax_compilation_cache_dir == given or used
            assert CONFIG.jax_compilation_cache_dir == given
            assert (tmp_path / "mine").exists() == used
    finally:
        jax.config.update("jax_compilation_cache_dir", before)
