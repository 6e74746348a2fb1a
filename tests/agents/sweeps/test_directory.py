"""Directories, axes and policies that will not do are named, and nothing is lost."""

from contextlib import suppress
from pathlib import Path

import pytest

from stickslip.agents import Idle, read_sweep, sweep, sweep_arrays
from stickslip.agents.biped.measures import Episodes
from stickslip.agents.machine import machine_of_env
from stickslip.agents.sweeps import cells
from stickslip.agents.ugv.controllers import Optimum
from stickslip.agents.ugv.episodes import UGVEpisodes
from stickslip.envs import BipedEnv, UGVEnv
from tests.agents.mass import MassEnv, Pull
from tests.agents.sweeps.masses import TASK, swept


def contents(path: Path) -> dict[str, bytes]:
    files = (one for one in path.rglob("*") if one.is_file())
    return {str(one.relative_to(path)): one.read_bytes() for one in files}


def test_another_definition_is_not_resumed_and_what_differs_is_said(tmp_path):
    swept(tmp_path)
    before = contents(tmp_path)
    for changes, said in (
        ({"episodes": 8}, "episodes 7, not 8"),
        ({"axes": {"mu": "0.02:0.3:5"}}, "axes, sets"),
        ({"cell": 100}, "cells of 40"),
    ):
        with pytest.raises(ValueError, match=said):
            swept(tmp_path, resume=True, **changes)
    with pytest.raises(ValueError, match="axes, policies, sets"):
        sweep(TASK, {"pull": Pull(), "hard": Pull(5.0)}, {}, 7, tmp_path, resume=True)
    with pytest.raises(ValueError, match=r"exists and is not empty; accepted: .*--resume"):
        swept(tmp_path)
    assert contents(tmp_path) == before


def test_a_sweep_that_could_not_begin_leaves_nothing(tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(cells, "write_whole", full)
        with pytest.raises(OSError, match="No space"):
            swept(tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_directory_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b/thesis.tex").write_text("mine")
    for how in ({}, {"resume": True}):
        with pytest.raises(ValueError, match=r"holds thesis\.tex, but no sweep"):
            swept(tmp_path / "b", **how)
    with pytest.raises(ValueError, match="is a file"):
        swept(tmp_path / "b/thesis.tex")
    assert contents(tmp_path / "b") == {"thesis.tex": b"mine"}


def test_damaged_and_foreign_files_are_named_and_left(tmp_path):
    swept(tmp_path / "a")
    swept(tmp_path / "other", episodes=3)
    file = tmp_path / "a/data/cell-000001.parquet"
    whole, table = file.read_bytes(), read_sweep(tmp_path / "a")
    for at in range(5, len(whole), 99):  # a bit that changes is noticed, or is of no consequence
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 16]) + whole[at + 1 :])
        with suppress(ValueError):
            assert read_sweep(tmp_path / "a").equals(table)
    for content, said in (
        (whole[: len(whole) // 2], "is damaged"),
        (b"", "is damaged"),
        ((tmp_path / "other/data/cell-000001.parquet").read_bytes(), "belongs to another store"),
    ):
        file.write_bytes(content)
        with pytest.raises(ValueError, match=f"cell-000001.parquet: it {said}.*--resume computes"):
            swept(tmp_path / "a", resume=True)
        for read in (read_sweep, sweep_arrays):
            with pytest.raises(ValueError, match=f"cell-000001.parquet: it {said}"):
                read(tmp_path / "a")
        assert file.read_bytes() == content
    file.unlink()
    with pytest.raises(ValueError, match=r"holds 11 of 12 cells.*--resume"):
        read_sweep(tmp_path / "a")
    assert swept(tmp_path / "a", resume=True).played == 1
    assert file.read_bytes() == whole
    (tmp_path / "a/data/cell-000999.parquet").write_bytes(whole)
    with pytest.raises(ValueError, match=r"cell-000999\.parquet is no cell of the sweep"):
        swept(tmp_path / "a", resume=True)
    (tmp_path / "a/sweep.json").write_text('{"format": "stickslip sweep", "version": 3}')
    with pytest.raises(ValueError, match=r"sweep\.json: .*accepted: the directory of a"):
        read_sweep(tmp_path / "a")
    with pytest.raises(ValueError, match=r"nowhere/sweep\.json: no such file"):
        read_sweep(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"axes": {"mu_pach": [1.0]}}, r"'mu_pach' is no number of this .*mean mu_patch\?"),
        ({"axes": {"mass": [1.0], "task.mass": [2.0]}}, "axes mass and task.mass both set task.m"),
        ({"episodes": 0}, "episodes = 0"),
        ({"cell": 0}, "cell = 0"),
    ],
)
def test_axes_and_numbers_that_will_not_do_are_refused(tmp_path, how, said: str):
    with pytest.raises(ValueError, match=said):
        swept(tmp_path / "out", **how)
    assert not (tmp_path / "out").exists()


def test_policies_and_tasks_that_will_not_do_are_refused(tmp_path):
    for task, who, said in (
        (TASK, ["pul"], r"'pul' is neither a baseline nor a file.*did you mean pull"),
        (TASK, {}, "no policy"),
        (TASK, {"many": Idle(7)}, r"shape \(7,\).*made for another machine"),
        (TASK, {"best": Optimum()}, "best = .*accepted: a controller"),
        ("BipedStedy", ["crank-speed-pi"], "did you mean BipedSteady-v0"),
        (7, ["pull"], "task = 7"),
        ((MassEnv(), 3), ["pull"], "params = 3"),
    ):
        with pytest.raises(ValueError, match=said):
            sweep(task, who, {}, 2, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("env", "kept"), [(BipedEnv(), Episodes), (UGVEnv(), UGVEpisodes)])
def test_what_is_written_of_an_episode_is_kept_and_has_a_unit(env, kept: type):
    units = machine_of_env(env).measures(env).kept
    assert {*units, "status"} <= set(kept.__annotations__)
    assert all(units.values())
