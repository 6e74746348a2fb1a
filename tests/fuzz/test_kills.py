"""Trainings killed at any moment go on to the very policy of one that was not.

STICKSLIP_KILLS: how many are killed (200). Two run side by side, in processes that have imported
everything already.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.training.directory import list_checkpoints
from tests.agents.runs import assert_same_run
from tests.extras import SB3

pytestmark = [
    pytest.mark.long,
    SB3,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork, no SIGKILL here"),
]

KILLS = int(os.environ.get("STICKSLIP_KILLS", "200"))
SIDE_BY_SIDE = 2
AGAIN = 0.25
"""Share of the trainings whose resumption is killed, too."""
REFUSED = 3
MOST_CHECKPOINTS = 8
A_CHECKPOINT = 0.3
"""About how long a training is from one to the next [s]: half of the kills fall between them."""
ROOT = Path(__file__).parents[2]


class Server:
    """See trainer.py."""

    def __init__(self, programs: Path):
        own = {
            "JAX_COMPILATION_CACHE_DIR": str(programs),
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
            "JAX_COMPILATION_CACHE_MAX_SIZE": "-1",
            "OMP_NUM_THREADS": "1",
            "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)]),
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.fuzz.trainer"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | own,
            cwd=ROOT,
        )

    def start(
        self, path: Path, kill_after: float | None = None, kill_from: int = 0, **how: bool
    ) -> None:
        assert self.process.stdin is not None
        asked = {"path": str(path), "how": how, "kill_after": kill_after, "kill_from": kill_from}
        self.process.stdin.write(json.dumps(asked) + "\n")
        self.process.stdin.flush()

    def wait(self) -> int:
        assert self.process.stdout is not None
        return int(self.process.stdout.readline())

    def train(
        self, path: Path, kill_after: float | None = None, kill_from: int = 0, **how: bool
    ) -> int:
        self.start(path, kill_after, kill_from, **how)
        return self.wait()

    def close(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(timeout=60)
        self.process.stdout.close()


@pytest.fixture(scope="module")
def servers(tmp_path_factory: pytest.TempPathFactory):
    programs = tmp_path_factory.mktemp("programs")
    made = [Server(programs) for _ in range(SIDE_BY_SIDE)]
    yield made
    for server in made:
        server.close()


@pytest.fixture(scope="module")
def whole(servers, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """A training that nothing interrupts, with its programs compiled before, and its duration."""
    folder = tmp_path_factory.mktemp("whole")
    assert servers[0].train(folder / "first") == 0, said(folder / "first")
    begun = time.monotonic()
    assert servers[0].train(folder / "second") == 0
    duration = time.monotonic() - begun
    assert_same_and_clean(folder / "first", folder / "second")
    return folder / "second", duration


def said(path: Path) -> str:
    file = Path(f"{path}.said")
    return file.read_text() if file.exists() else ""


def assert_same_and_clean(one: Path, other: Path) -> None:
    """The same run, and nothing half-written beside the other."""
    assert_same_run(one, other)
    assert not list(other.rglob("*.part"))


def trial(server: Server, path: Path, seed: int, duration: float) -> str:
    """Kill a training, perhaps its resumption, and let it come to its end; where it was killed."""
    rng, how, place = np.random.default_rng(seed), {}, ""
    while True:
        if rng.random() < 0.5:  # most of the time goes by before the first checkpoint
            status = server.train(path, rng.uniform(0, duration), **how)
        else:
            from_, after = int(rng.integers(1, MOST_CHECKPOINTS)), rng.uniform(0, A_CHECKPOINT)
            status = server.train(path, after, from_, **how)
        if status == 0:
            return place or "had ended"
        assert status == -signal.SIGKILL, said(path)
        how = {"resume": True} if (path / "config.json").exists() else {}
        steps = list_checkpoints(path / "checkpoints")
        place = f"after {int(steps[-1].name)} steps" if steps else "before any checkpoint"
        place = place if how else "before it was a run"
        if rng.random() > AGAIN:
            assert server.train(path, **how) == 0, said(path)
            return place


def test_a_training_killed_at_any_moment_ends_with_the_same_policy(servers, whole, tmp_path: Path):
    reference, duration = whole
    places: Counter[str] = Counter()
    failures: list[str] = []
    todo = iter(range(KILLS))
    lock = threading.Lock()

    def work(server: Server) -> None:
        while True:
            with lock:
                seed = next(todo, None)
            if seed is None:
                return
            path = tmp_path / str(seed)
            try:
                place = trial(server, path, seed, duration)
                assert_same_and_clean(reference, path)
                with lock:
                    places[place] += 1
                shutil.rmtree(path)
            except Exception as error:  # noqa: BLE001, told below for all of them
                failures.append(f"{seed}: {type(error).__name__}: {error} {said(path)}")

    threads = [threading.Thread(target=work, args=(server,)) for server in servers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print(f"\nkilled: {KILLS} trainings of {duration:.1f} s, the same policy: {places.total()}")
    for place, count in sorted(places.items()):
        print(f"  {place:24} {count}")
    assert not failures, "\n".join(failures[:5])
    assert places.total() == KILLS


def test_a_second_process_is_refused_and_the_first_unharmed(servers, whole, tmp_path: Path):
    reference, _ = whole
    path = tmp_path / "run"
    first, second = servers
    held = tmp_path / "run.held"
    held.touch()
    first.start(path)
    while not (path / "metrics.csv").exists():
        time.sleep(0.01)
    for how in ({"resume": True}, {"overwrite": True}, {}):
        assert second.train(path, **how) == REFUSED, how
    held.unlink()
    assert first.wait() == 0, said(path)
    assert said(path).count("another process is training there") == 3
    assert_same_and_clean(reference, path)
