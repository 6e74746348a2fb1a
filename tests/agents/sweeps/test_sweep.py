"""A sweep writes what evaluation finds, however it is cut, and goes on where it was stopped."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from stickslip.agents import evaluate, read_sweep, sweep_arrays
from stickslip.agents.sweeps import cells
from stickslip.agents.sweeps.plan import digest_of
from stickslip.envs import BipedEnv
from stickslip.records.signals import StoppedError
from tests.agents.mass import MassEnv, MassParams
from tests.agents.sweeps.masses import TASK, WHO, swept


def rows(path: Path) -> pa.Table:
    return read_sweep(path).combine_chunks()


def test_no_result_depends_on_cores_or_their_order_nor_but_for_roundings_on_cells(tmp_path):
    first = swept(tmp_path / "a", executor=ThreadPoolExecutor(1))
    assert (first.episodes, first.cells, first.played) == (420, 12, 12)
    whole = rows(tmp_path / "a")
    swept(tmp_path / "b", executor=ThreadPoolExecutor(3))
    assert rows(tmp_path / "b").equals(whole)
    numbers = ["reward", "duration"]
    for cell in (3, None):
        swept(tmp_path / f"{cell}", cell=cell)
        found = rows(tmp_path / f"{cell}")
        assert found.drop_columns(numbers).equals(whole.drop_columns(numbers))
        assert all(np.allclose(found[one], whole[one], 1e-6, 1e-6) for one in numbers)


def test_an_episode_is_the_one_that_evaluate_plays(tmp_path):
    swept(tmp_path, axes={"mu": [0.1, 0.3], "mass": [2.0, 4.0]})
    found = sweep_arrays(tmp_path)
    assert found.dims == ("task", "policy", "mu", "mass", "seed")
    told = evaluate(MassEnv(), WHO, {"": MassParams(mu=0.3, mass=4.0, time_limit=1.0)}, episodes=7)
    for name in WHO:
        expected = told.row("", name).episodes.reward
        assert np.allclose(found["reward"][0, list(WHO).index(name), 1, 1], expected, rtol=1e-6)
        assert np.std(expected) > 1e-3


def test_a_sweep_that_is_stopped_goes_on_with_what_is_missing_alone(tmp_path, monkeypatch):
    swept(tmp_path / "whole")
    write, written = cells.write_cell, []
    monkeypatch.setattr(cells, "WINDOW", 3)
    monkeypatch.setattr(cells, "write_cell", lambda *cell: written.append(write(*cell)))
    with pytest.raises(StoppedError):
        swept(tmp_path / "a", executor=ThreadPoolExecutor(1), stop=lambda: len(written) > 2)
    assert 3 <= len(written) <= 6
    there = {one.name: one.stat().st_mtime_ns for one in (tmp_path / "a/data").iterdir()}
    (tmp_path / "a/data/.cell-000011.parquet-1a2b.part").write_bytes(b"killed here")
    done = swept(tmp_path / "a", executor=ThreadPoolExecutor(1), resume=True)
    assert done.played == 12 - len(there)
    assert {name: (tmp_path / "a/data" / name).stat().st_mtime_ns for name in there} == there
    assert rows(tmp_path / "a").equals(rows(tmp_path / "whole"))
    assert swept(tmp_path / "a", resume=True).played == 0


def test_files_say_what_they_are(tmp_path):
    swept(tmp_path)
    table = rows(tmp_path)
    assert {one.name: one.metadata[b"unit"].decode() for one in table.schema}["duration"] == "s"
    about = json.loads((tmp_path / "sweep.json").read_text())
    assert about["versions"].keys() >= {"stickslip", "jax", "numpy", "pyarrow", "python"}
    assert len(about["digest"]) == 64
    assert about["definition"]["sets"]["mu_patch"] == ["task.mu_patch"]
    assert set(table["policy"].to_pylist()) == {"pull", "hard"}


def test_environments_of_one_name_are_played_each_by_itself_and_no_other_one_is_resumed(tmp_path):
    def env(factor):
        class Env(MassEnv):
            def step_env(self, state, action, params):
                obs, state, reward, *rest = super().step_env(state, action, params)
                return obs, state, factor * reward, *rest

        return Env()

    task, how = {"a": (env(1.0), TASK[1]), "b": (env(2.0), TASK[1])}, {"axes": {"mu": [0.1, 0.3]}}
    swept(tmp_path, task=task, **how)
    first, second = sweep_arrays(tmp_path)["reward"]
    assert np.allclose(second, 2 * first, rtol=1e-6)
    with pytest.raises(ValueError, match="tasks"):
        swept(tmp_path, task={"a": TASK, "b": task["b"]}, resume=True, **how)


def test_environments_that_differ_in_what_their_repr_leaves_out_have_other_digests():
    envs = [BipedEnv(), BipedEnv(see_motion=False), BipedEnv(shield=0.02), BipedEnv(shield=0.03)]
    assert len({digest_of(env) for env in envs}) == len(envs)
