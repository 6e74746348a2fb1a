"""Cells on Dask's workers: the same rows, nothing lost, nothing twice."""

import os
import signal
from functools import partial
from pathlib import Path

import pytest

from stickslip.agents import read_sweep, sweep
from stickslip.agents.machine import register, unregister
from stickslip.agents.sweeps import cells
from stickslip.agents.sweeps import sweep as sweeping
from tests.agents.mass import MassMachine
from tests.agents.sweeps.masses import TASK, WHO, swept

LocalCluster = pytest.importorskip("distributed").LocalCluster


def test_one_of_workers_and_a_scheduler_and_one_that_answers(monkeypatch):
    for how in ((None, None), (1, "tcp://127.0.0.1:1")):
        with pytest.raises(ValueError, match="accepted: one of them"), cells.dask_pool(*how):
            pass
    monkeypatch.setattr(cells, "CONNECT", 0.2)
    unreachable = cells.dask_pool(None, "tcp://127.0.0.1:1")
    with pytest.raises(ValueError, match="no Dask scheduler answers at"), unreachable:
        pass
    with pytest.raises(ValueError, match="workers = 0"), cells.dask_pool(0, None):
        pass


def test_threads_as_workers_write_the_same_rows(tmp_path, monkeypatch):
    swept(tmp_path / "here")
    monkeypatch.setattr(sweeping, "dask_pool", partial(cells.dask_pool, processes=False))
    swept(tmp_path / "there", workers=2)
    here, there = (read_sweep(tmp_path / one).combine_chunks() for one in ("here", "there"))
    assert there.equals(here)


BIG = {"axes": {"mu": "0.02:0.3:20", "mass": "0.5:3:15"}, "episodes": 40}
"""24,000 episodes of 2 policies in 600 cells: longer than what is done to it."""


def big(out: Path, **how):
    return sweep(TASK, WHO, out=out, cell=40, **BIG, **how)


def count(path: Path) -> int:
    return len(list((path / "data").glob("cell-*.parquet")))


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    register(MassMachine())
    path = tmp_path_factory.mktemp("expected")
    big(path)
    unregister("mass")
    return read_sweep(path).combine_chunks()


@pytest.fixture
def cluster():
    with LocalCluster(2, threads_per_worker=1, dashboard_address=None, memory_limit=0) as found:
        yield found


@pytest.mark.long
def test_a_worker_that_is_killed_loses_nothing(tmp_path, expected, cluster):
    killed = []

    def stop() -> bool:
        if not killed and count(tmp_path) > 30:
            killed.append(cluster.workers[0].pid)
            os.kill(killed[0], signal.SIGKILL)
        return False

    big(tmp_path, scheduler=cluster.scheduler_address, stop=stop)
    assert killed
    assert read_sweep(tmp_path).combine_chunks().equals(expected)


@pytest.mark.long
def test_a_scheduler_that_is_lost_is_named_and_the_rest_is_played_here(
    tmp_path, expected, cluster, monkeypatch
):
    def stop() -> bool:
        if count(tmp_path) > 30:
            cluster.close()
        return False

    with pytest.raises(OSError, match="the Dask scheduler does not answer any more"):
        big(tmp_path, scheduler=cluster.scheduler_address, stop=stop)
    kept = count(tmp_path)
    assert 30 < kept < 600
    assert big(tmp_path, resume=True).played == 600 - kept
    assert read_sweep(tmp_path).combine_chunks().equals(expected)
