"""Programs kept for the next command: the same, whole, the user's alone, never in the way."""

import os
import sys
import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip import programs
from stickslip.cli import WRONG_INPUT, main
from stickslip.compiling import said_when_compiling
from stickslip.programs import compiled_programs, kept_programs, programs_folder

CONFIG: Any = jax.config
POSIX = pytest.mark.skipif(os.name != "posix", reason="of POSIX systems")


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


def kept(store: Path) -> list[Path]:
    return [path for path in store.iterdir() if programs.KEPT.fullmatch(path.name)]


def test_what_one_command_compiles_the_next_one_finds(store):
    before = CONFIG.jax_compilation_cache_dir
    first, hits = run(store)
    assert hits == 0
    assert len(kept(store)) == 1
    again, hits = run(store)
    assert hits == 1
    assert again == first
    assert list(store.iterdir()) == kept(store)
    assert CONFIG.jax_compilation_cache_dir == before


@pytest.mark.parametrize(
    "damage",
    [
        lambda raw: b"",
        lambda raw: raw[: len(raw) // 2],
        lambda raw: raw[:-1] + bytes([raw[-1] ^ 1]),
        lambda raw: raw[:40] + b"\xff" * 8 + raw[48:],
        lambda raw: b"not a program",
    ],
    ids=["empty", "cut", "last bit", "middle", "text"],
)
def test_a_damaged_program_is_dropped_and_compiled_again(store, damage):
    first, _ = run(store)
    (path,) = kept(store)
    sound = path.read_bytes()
    path.write_bytes(damage(sound))
    assert run(store) == (first, 0)
    assert run(store) == (first, 1)
    (again,) = kept(store)
    assert again.name[33:] == path.name[33:]
    (store / "a file of somebody's").write_text("stays")
    (store / f"{'0' * 32}.jit_other-cache").write_bytes(b"damaged")
    assert run(store) == (first, 1)
    assert {one.name for one in store.iterdir()} == {again.name, "a file of somebody's"}


def test_what_a_full_disk_cut_short_is_not_kept(store, monkeypatch):
    whole = programs._publish

    def cut(store: Path, work: Path) -> None:
        for path in work.iterdir():
            path.write_bytes(path.read_bytes()[:100])
        whole(store, work)

    monkeypatch.setattr(programs, "_publish", cut)
    run(store)
    assert list(store.iterdir()) == []


def test_two_at_once_keep_one_program(store):
    run(store)
    (path,) = kept(store)
    content = path.read_bytes() + b"\0"
    path.with_name(f"{programs._digest(content)}.{path.name[33:]}").write_bytes(content)
    run(store)
    assert len(kept(store)) == 1


@POSIX
def test_what_a_command_that_died_may_have_read_is_not_read_again(store, monkeypatch):
    monkeypatch.setattr(programs, "_machine", lambda: "here")
    run(store)
    alive = store / f".use-{programs._host()}-{os.getpid()}-00000000"
    alive.mkdir()
    assert programs._prepared(store.parent) == store
    assert len(kept(store)) == 1
    gone = store / f".use-{programs._host()}-{2**22 + 1}-00000000"
    gone.mkdir()
    assert programs._prepared(store.parent) == store
    assert list(store.iterdir()) == [alive]
    elsewhere = store / ".use-another-host-1-00000000"
    elsewhere.mkdir()
    programs._prepared(store.parent)
    assert elsewhere.exists()
    os.utime(elsewhere, (0, time.time() - programs.FORGOTTEN - 1))
    programs._prepared(store.parent)
    assert not elsewhere.exists()


@POSIX
def test_a_folder_that_others_may_write_to_or_that_is_none_is_not_used(tmp_path):
    folder = tmp_path / "cache"
    assert programs._prepared(folder) is not None
    folder.chmod(0o777)
    assert programs._prepared(folder) is None
    (tmp_path / "file").write_text("")
    assert programs._prepared(tmp_path / "file" / "cache") is None


def test_the_oldest_go_where_there_are_too_many(store, monkeypatch):
    other = store.with_name("programs-of-an-older-version")
    other.mkdir()
    for age, path in enumerate([store / "b", other / "a", store / "c"]):
        name = path.with_name(f"{path.name * 32}.jit_f-cache")
        name.write_bytes(bytes(100))
        os.utime(name, (0, 1000 - age))
    monkeypatch.setattr(programs, "LARGEST", 200)
    programs._shrink(store.parent)
    left = [path.name[0] for path in sorted(store.parent.glob("*/*"))]
    assert sorted(left) == ["a", "b"]


@pytest.mark.parametrize(
    ("system", "environment", "folder"),
    [
        ("linux", {"HOME": "/home/me"}, "/home/me/.cache/stickslip"),
        ("linux", {"HOME": "/home/me", "XDG_CACHE_HOME": "/fast"}, "/fast/stickslip"),
        ("linux", {"HOME": "/home/me", "XDG_CACHE_HOME": "here"}, "/home/me/.cache/stickslip"),
        ("linux", {}, None),
        ("darwin", {"HOME": "/Users/me"}, "/Users/me/Library/Caches/stickslip"),
        ("win32", {"LOCALAPPDATA": "C:/Local"}, "C:/Local/stickslip/Cache"),
        ("win32", {"HOME": "/home/me"}, None),
        ("linux", {"HOME": "/home/me", "STICKSLIP_CACHE": "/mine"}, "/mine"),
        ("linux", {"HOME": "/home/me", "STICKSLIP_CACHE": "OFF"}, None),
    ],
)  # fmt: skip
def test_programs_lie_in_the_cache_folder_of_the_system(system, environment, folder):
    assert programs_folder(environment, system) == (folder and Path(folder))


def test_a_cache_that_the_user_has_set_stays_as_it_is(tmp_path, monkeypatch):
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "mine"))
    set_by_user = str(tmp_path / "jax")
    before = CONFIG.jax_compilation_cache_dir
    try:
        for own, keep, used in (
            (set_by_user, True, False),
            (None, False, False),
            (None, True, True),
        ):
            jax.config.update("jax_compilation_cache_dir", own)
            with compiled_programs(keep):
                inside = CONFIG.jax_compilation_cache_dir
                assert inside == own or used
            assert CONFIG.jax_compilation_cache_dir == own
            assert (tmp_path / "mine").exists() == used
    finally:
        jax.config.update("jax_compilation_cache_dir", before)


def test_an_error_passes_through_and_leaves_nothing_behind(store):
    with pytest.raises(KeyError), kept_programs(store):
        raise KeyError
    assert list(store.iterdir()) == []
    assert main(["evaluate", "nobody", "--no-cache"]) == WRONG_INPUT


@pytest.mark.parametrize(("patience", "times"), [(0.0, 1), (1e6, 0)])
def test_compiling_is_said_once_where_it_takes_long(patience, times):
    said: list[int] = []
    with said_when_compiling(lambda: said.append(1), patience):
        for power in (2, 3):
            jax.jit(lambda x, power=power: x**power)(np.float32(2))
    assert len(said) == times
    jax.jit(lambda x: x**5)(np.float32(2))
    assert len(said) == times


def test_compiling_is_said_while_it_lasts():
    from jax import monitoring

    from stickslip.compiling import COMPILED

    said: list[int] = []
    with said_when_compiling(lambda: said.append(1), 0.01):
        monitoring.record_scalar(COMPILED, time.time())
        while not said:
            time.sleep(0.01)
        monitoring.record_event_duration_secs(COMPILED, 5.0)
    assert said == [1]


def test_the_line_goes_to_stderr(capsys, monkeypatch):
    monkeypatch.setattr(sys.modules["stickslip.compiling"], "PATIENCE", 0.0)
    with compiled_programs(keep=False):
        jax.jit(lambda x: x**7)(np.float32(2))
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("compiling programs")
    assert shown.err.count("\n") == 1
