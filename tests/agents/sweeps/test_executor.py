"""Cells in other processes: the same rows, and nothing is lost with a worker."""

import os
import signal
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from stickslip.agents import read_sweep
from tests.agents.sweeps.masses import swept


def ends(play: Callable[[int], object], number: int) -> object:
    """Compute a cell, the seventh in a process that is killed."""
    if number == 6:
        os.kill(os.getpid(), signal.SIGKILL)
    return play(number)


class Mortal(Executor):
    """One process, which cell 6 ends."""

    def __init__(self, pool: ProcessPoolExecutor):
        self.pool = pool

    def submit(self, fn, /, *args, **kwargs) -> Future:
        return self.pool.submit(ends, fn, *args)


def test_processes_write_the_same_rows_and_a_lost_one_is_resumed_here(tmp_path):
    with pytest.raises(ValueError, match="executor = 'dask'; accepted: None, or an Executor"):
        swept(tmp_path / "here", executor="dask")  # and leaves no directory
    swept(tmp_path / "here")
    here = read_sweep(tmp_path / "here").combine_chunks()
    lost = pytest.raises(OSError, match="workers were lost; what was written stays")
    with ProcessPoolExecutor(1, get_context("spawn")) as pool, lost:
        swept(tmp_path / "there", executor=Mortal(pool))
    kept = len(list((tmp_path / "there/data").glob("cell-*.parquet")))
    assert 0 < kept < 12
    assert swept(tmp_path / "there", resume=True).played == 12 - kept
    assert read_sweep(tmp_path / "there").combine_chunks().equals(here)
