"""Cells on Dask's workers: the same rows, nothing lost, nothing twice."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from stickslip.agents import read_sweep, sweep
from stickslip.agents.sweeps import cells
from stickslip.agents.sweeps import sweep as sweeping
from tests.agents.sweeps.masses import TASK, WHO, swept

pytest.importorskip("distributed")
ROOT = Path(__file__).parents[3]


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


def started(script: str, *words: str) -> subprocess.Popen:
    """A process that finds what this one finds, its own group."""
    paths = os.pathsep.join([str(ROOT), *filter(None, sys.path)])
    return subprocess.Popen(
        [sys.executable, "-c", script, *words],
        env=os.environ | {"PYTHONPATH": paths, "JAX_PLATFORMS": "cpu"},
        start_new_session=True,
        stderr=subprocess.DEVNULL,
    )


def killed(process: subprocess.Popen) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


RUNNING = """
import asyncio, sys
from distributed import Scheduler, Worker
async def main():
    async with {what} as running:
        await running.finished()
asyncio.run(main())
"""
SCHEDULER = 'Scheduler(host="127.0.0.1", port=int(sys.argv[1]), dashboard=False)'
WORKER = 'Worker(f"tcp://127.0.0.1:{sys.argv[1]}", nthreads=1, memory_limit=0)'


def a_scheduler(port: int) -> subprocess.Popen:
    return started(RUNNING.replace("{what}", SCHEDULER), str(port))


def a_worker(port: int) -> subprocess.Popen:
    return started(RUNNING.replace("{what}", WORKER), str(port))


@contextmanager
def processes(*begun: subprocess.Popen) -> Iterator[list[subprocess.Popen]]:
    found = list(begun)
    try:
        yield found
    finally:
        for one in found:
            killed(one)


def free_port() -> int:
    import socket

    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


BIG = {"axes": {"mu": "0.02:0.3:20", "mass": "0.5:3:15"}, "samples": None, "episodes": 40}
"""6000 episodes of 2 policies in 600 cells: longer than what is done to it."""


def big(out: Path, **how):
    return sweep(TASK, WHO, out=out, cell=40, **BIG, **how)


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    from stickslip.agents.registry import register, unregister
    from tests.agents.mass import MassMachine

    register(MassMachine())
    path = tmp_path_factory.mktemp("expected")
    sweep(TASK, WHO, out=path, cell=40, **BIG)
    unregister("mass")
    return read_sweep(path).combine_chunks()


@pytest.mark.long
def test_a_worker_that_is_killed_loses_nothing(tmp_path, expected):
    port = free_port()
    with processes(a_scheduler(port), a_worker(port), a_worker(port)) as running:
        written = tmp_path / "data"

        def stop() -> bool:
            if len(running) == 3 and written.exists() and len(list(written.iterdir())) > 30:
                killed(running[1])
                running.append(a_worker(port))
            return False

        big(tmp_path, scheduler=f"tcp://127.0.0.1:{port}", stop=stop)
        assert len(running) == 4
    assert read_sweep(tmp_path).combine_chunks().equals(expected)


@pytest.mark.long
def test_a_scheduler_that_is_lost_is_named_and_the_rest_is_played_here(
    tmp_path, expected, monkeypatch
):
    monkeypatch.setattr(cells, "CONNECT", 2.0)
    port = free_port()
    with processes(a_scheduler(port), a_worker(port)) as running:
        written = tmp_path / "data"

        def stop() -> bool:
            if written.exists() and len(list(written.iterdir())) > 30:
                killed(running[0])
            return False

        with pytest.raises(OSError, match="the Dask scheduler does not answer any more"):
            big(tmp_path, scheduler=f"tcp://127.0.0.1:{port}", stop=stop)
    kept = len(list((tmp_path / "data").iterdir()))
    assert 30 < kept < 600
    assert big(tmp_path, resume=True).played == 600 - kept
    assert read_sweep(tmp_path).combine_chunks().equals(expected)


CLIENT = """
import sys
from pathlib import Path
from stickslip.agents import register
from tests.agents.mass import MassMachine
from tests.agents.sweeps.test_dask import big
if __name__ == "__main__":
    register(MassMachine())
    big(Path(sys.argv[1]), workers=1)
"""


@pytest.mark.long
def test_a_client_that_is_killed_leaves_what_is_whole_and_is_resumed(tmp_path, expected):
    script = tmp_path / "client.py"
    script.write_text(CLIENT)
    paths = os.pathsep.join([str(ROOT), *filter(None, sys.path)])
    out = tmp_path / "out"
    client = subprocess.Popen(
        [sys.executable, str(script), str(out)],
        env=os.environ | {"PYTHONPATH": paths},
        start_new_session=True,
    )
    try:
        for _ in range(1200):
            if (out / "data").exists() and len(list((out / "data").iterdir())) > 30:
                break
            assert client.poll() is None
            time.sleep(0.1)
    finally:
        killed(client)
    kept = len(list((out / "data").glob("cell-*.parquet")))
    assert 30 <= kept < 600
    assert big(out, resume=True).played == 600 - kept
    assert read_sweep(out).combine_chunks().equals(expected)
