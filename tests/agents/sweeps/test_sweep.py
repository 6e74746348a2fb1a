"""A sweep writes what evaluation finds, however it is cut, and goes on where it was stopped."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from stickslip.agents import evaluate, read_sweep, sweep, sweep_arrays
from stickslip.agents.sweeps.files import chunks
from stickslip.agents.sweeps.files.directory import missing_chunks
from stickslip.agents.sweeps.playing import program
from stickslip.agents.sweeps.playing.play import StoppedError, summary
from stickslip.envs.rendering.html.reading import read_episodes
from tests.agents.mass import MassEnv, MassParams, Pull
from tests.agents.sweeps.masses import AXES, TASK, WHO, swept

FULL_DISK = 28


def rows(path: Path) -> pa.Table:
    return read_sweep(path).combine_chunks()


def same_but_for_roundings(found: pa.Table, expected: pa.Table) -> bool:
    """Programs of other sizes may round elsewhere, processor by processor."""
    numbers = ("reward", "duration")
    assert found.drop_columns(numbers).equals(expected.drop_columns(numbers))
    return all(np.allclose(found[one], expected[one], rtol=1e-6, atol=1e-6) for one in numbers)


def test_no_result_depends_on_chunks_cores_or_their_order(tmp_path):
    first = swept(tmp_path / "a", chunk=1, cores=1)
    assert (first.episodes, first.chunks, first.programs) == (420, 12, 1)
    whole = rows(tmp_path / "a")
    for name, how in {
        "b": {"chunk": 100, "cores": 2},
        "c": {"chunk": 10**6, "cores": 1},
        "d": {},
    }.items():
        swept(tmp_path / name, **how)
        assert rows(tmp_path / name).equals(whole)
    swept(tmp_path / "e", tile=3)
    assert same_but_for_roundings(rows(tmp_path / "e"), whole)


def test_an_episode_is_the_one_that_evaluate_plays(tmp_path):
    swept(tmp_path, axes={"mu": [0.1, 0.3], "mass": [2.0, 4.0]}, samples=None)
    found = sweep_arrays(tmp_path)
    assert found.dims == ("task", "policy", "mu", "mass", "seed")
    params = MassParams(mu=0.3, mass=4.0, time_limit=1.0)
    told = evaluate(MassEnv(), WHO, {"": params}, episodes=7)
    for name in WHO:
        expected = told.row("", name).episodes.reward
        mine = found.at("reward", task="own", policy=name, mu=0.3, mass=4.0)
        assert np.allclose(mine, expected, rtol=1e-6)
        assert np.std(expected) > 1e-3


def test_draws_are_common_to_all_points_unless_they_are_to_be_independent(tmp_path):
    axes = {"force_limit": [1e-9, 2e-9, 3e-9]}  # nothing moves, so the return tells the start
    swept(tmp_path / "a", axes=axes, samples=None)
    swept(tmp_path / "b", axes=axes, samples=None, independent=True)
    swept(tmp_path / "c", axes={"force_limit": [3e-9, 1e-9]}, samples=None, independent=True)
    same, apart, fewer = (sweep_arrays(tmp_path / one)["reward"][0, 0] for one in "abc")
    assert np.allclose(same, same[:1], atol=1e-6)
    assert len(np.unique(apart)) == apart.size
    assert np.array_equal(fewer, apart[[2, 0]])  # by the axes' values, not by their places


def test_summaries_are_those_of_the_episodes(tmp_path):
    swept(tmp_path / "rows")
    swept(tmp_path / "points", summaries=True)
    mine, theirs = (sweep_arrays(tmp_path / one, summaries=True) for one in ("rows", "points"))
    assert mine.dims == theirs.dims == ("task", "policy", "mu", "sample")
    episodes = sweep_arrays(tmp_path / "rows")["reward"].astype(float)
    assert np.allclose(mine["reward_mean"], episodes.mean(-1))
    assert np.allclose(mine["reward_std"], episodes.std(-1, ddof=1))
    assert np.allclose(mine["reward_q50"], np.median(episodes, -1))
    for name in mine.arrays:
        assert np.array_equal(mine[name], theirs[name])
    for name in ("task.mass", "mu_patch"):
        assert np.array_equal(mine.coordinates[name], theirs.coordinates[name])
    assert read_sweep(tmp_path / "points").num_rows == 60


def test_a_summary_counts_endings_and_has_no_spread_of_one_episode():
    columns = {
        "reward": np.array([1.0, 2.0, 5.0, 5.0]),
        "fell": np.array([True, False, True, True]),
        "ending": np.array([2, 0, 2, 4], np.int8),
    }
    found = summary(columns, 2)
    assert found["falls"].tolist() == [1, 2]
    assert (found["topple"].tolist(), found["runaway"].tolist()) == ([1, 1], [0, 1])
    assert found["reward_mean"].tolist() == [1.5, 5]
    assert np.all(np.isnan(summary(columns, 1)["reward_std"]))


def test_what_is_of_whole_episodes_is_summed_up_without_those_that_fell():
    columns = {
        "cost": np.array([1.0, 9.0, 3.0, 2.0, 9.0, 9.0, 9.0, 9.0, 9.0]),
        "reward": np.arange(9.0),
        "fell": np.array([0, 1, 0, 0, 1, 1, 1, 1, 1], bool),
    }
    found = summary(columns, 3, ("cost",))
    assert found["falls"].tolist() == [1, 2, 3]
    np.testing.assert_array_equal(found["cost_mean"], [2.0, 2.0, np.nan])
    np.testing.assert_array_equal(found["cost_std"], [np.sqrt(2), np.nan, np.nan])
    np.testing.assert_array_equal(found["cost_q50"], [2.0, 2.0, np.nan])
    np.testing.assert_array_equal(found["reward_mean"], [1.0, 4.0, 7.0])


def test_a_sweep_that_is_stopped_goes_on_with_what_is_missing_alone(tmp_path, monkeypatch):
    swept(tmp_path / "whole", chunk=1)
    write, written = chunks.write_chunk, []

    def slower(path, table):
        write(path, table)
        written.append(path)
        time.sleep(0.5 if len(written) > 2 else 0)  # until somebody looks

    monkeypatch.setattr(chunks, "write_chunk", slower)
    with pytest.raises(StoppedError):
        swept(tmp_path / "a", chunk=1, cores=1, stop=lambda: len(written) > 2)
    assert 3 <= len(written) < 12
    there = {one.name: one.stat().st_mtime_ns for one in (tmp_path / "a/data").iterdir()}
    (tmp_path / "a/data/.chunk-000011.parquet-1a2b.part").write_bytes(b"killed here")
    done = swept(tmp_path / "a", chunk=1, cores=1, resume=True)
    assert done.played == 12 - len(there)
    kept = {name: (tmp_path / "a/data" / name).stat().st_mtime_ns for name in there}
    assert kept == there
    assert rows(tmp_path / "a").equals(rows(tmp_path / "whole"))
    assert swept(tmp_path / "a", resume=True).played == 0


def test_what_lacks_memory_is_halved_and_comes_out_the_same(tmp_path, monkeypatch):
    swept(tmp_path / "a")
    played, sizes = program.Programs._played, []

    def poor(self, case, place, tile, device):
        sizes.append(len(tile.seeds))
        if len(tile.seeds) > 10:
            raise RuntimeError("RESOURCE_EXHAUSTED: Out of memory allocating 9 bytes")
        return played(self, case, place, tile, device)

    monkeypatch.setattr(program.Programs, "_played", poor)
    swept(tmp_path / "b")
    assert {35, 18, 9} == set(sizes)
    assert same_but_for_roundings(rows(tmp_path / "b"), rows(tmp_path / "a"))


def test_where_not_one_episode_fits_that_is_said(tmp_path, monkeypatch):
    def none(*given):
        raise MemoryError

    monkeypatch.setattr(program.Programs, "_played", none)
    with pytest.raises(MemoryError, match="one episode of 10 steps"):
        swept(tmp_path)


def test_another_failure_is_no_lack_of_memory(tmp_path, monkeypatch):
    def wrong(*given):
        raise RuntimeError("INTERNAL: something else")

    monkeypatch.setattr(program.Programs, "_played", wrong)
    with pytest.raises(RuntimeError, match="something else"):
        swept(tmp_path)
    assert list((tmp_path / "data").iterdir()) == []


def test_a_full_disk_is_named_and_loses_nothing(tmp_path, monkeypatch):
    write, left = chunks.write_chunk, iter(range(5))

    def full(path, table):
        if next(left, None) is None:
            raise OSError(FULL_DISK, "No space left on device")
        write(path, table)

    monkeypatch.setattr(chunks, "write_chunk", full)
    with pytest.raises(OSError, match="No space left on device; what was written before is whole"):
        swept(tmp_path, chunk=1, cores=1)
    assert len(list((tmp_path / "data").iterdir())) == 5
    monkeypatch.setattr(chunks, "write_chunk", write)
    assert swept(tmp_path, chunk=1, cores=1, resume=True).played == 7


def test_files_say_what_they_are(tmp_path):
    swept(tmp_path)
    table = rows(tmp_path)
    units = {one.name: one.metadata[b"unit"].decode() for one in table.schema}
    assert units["duration"] == "s"
    about = json.loads((tmp_path / "sweep.json").read_text())
    assert about["versions"].keys() >= {"stickslip", "jax", "numpy", "pyarrow", "python"}
    assert len(about["digest"]) == 64
    assert about["definition"]["axes"]["mu_patch"]["sets"] == ["task.mu_patch"]
    assert set(table["policy"].to_pylist()) == {"pull", "hard"}


def test_a_reset_that_draws_nothing_is_played_once(tmp_path):
    from tests.agents.sweeps.still import STILL

    done = sweep(STILL, {"pull": Pull()}, {"mu": [0.1, 0.2]}, 50, tmp_path, report=False)
    assert (done.episodes, done.report) == (2, None)
    assert not (tmp_path / "report.html").exists()


def test_a_sweep_ends_with_its_report_and_loses_nothing_to_it(tmp_path, monkeypatch):
    given: dict[str, Any] = {"axes": {"mu": [0.1, 0.2, 0.3]}, "episodes": 2, "out": tmp_path}
    given |= {"chunk": 1, "cores": 1, "tile": 2}
    sweep(TASK, WHO, **given, report=False)
    assert not (tmp_path / "report.html").exists()
    for number in (1, 4):  # as if it had been killed
        (tmp_path / f"data/chunk-{number:06d}.parquet").unlink()
    done = sweep(TASK, WHO, **given, resume=True)
    assert done.played == 2
    assert done.report == tmp_path / "report.html"
    returns = np.asarray(read_sweep(tmp_path)["reward"])  # of both calls
    shown = {one.name.partition(":")[0]: one for one in read_episodes(done.report)}
    for why, told in (("least return", returns.min()), ("greatest return", returns.max())):
        assert shown[why].panels[-1].lines[0].values[-1] == pytest.approx(told, rel=1e-4)
    assert "mean return" in (tmp_path / "summary.txt").read_text(encoding="utf-8")
    monkeypatch.setattr("stickslip.agents.reports.swept.write_report", lambda *a, **b: 1 / 0)
    with pytest.warns(RuntimeWarning, match=r"report\.html could not be written \(ZeroDivision"):
        assert sweep(TASK, WHO, **given, resume=True).report is None
    assert len(read_sweep(tmp_path)) == 12


def test_chunks_that_are_missing_are_found_without_reading_rows(tmp_path, monkeypatch):
    swept(tmp_path, chunk=1)
    from stickslip.agents.sweeps.design import design_of
    from stickslip.agents.sweeps.named import played_on
    from stickslip.agents.sweeps.plan import Plan

    machine, played = played_on(TASK, WHO)
    how = {"episodes": 7, "independent": False, "summaries": False}
    plan = Plan.of(machine, played, design_of(AXES, 6, 0), **how).cut(1, 1, 40)
    monkeypatch.setattr("pyarrow.parquet.read_table", None)
    assert missing_chunks(tmp_path, plan) == []
    (tmp_path / "data/chunk-000003.parquet").unlink()
    assert missing_chunks(tmp_path, plan) == [3]
