"""Damaged and hostile files of a sweep; counts are printed."""

import json
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import read_sweep
from tests.agents.sweeps.masses import swept
from tests.fuzz.spoilt import PIECES, mutated

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("mass")]

COUNT = 2000


WRITER = """
import sys
from pathlib import Path
from stickslip.agents.machine import register
from tests.agents.mass import MassMachine
from tests.agents.sweeps.masses import swept
register(MassMachine())
try:
    swept(Path(sys.argv[1]), episodes=2000, cell=2000, **eval(sys.argv[2]))
except ValueError as error:
    sys.exit(str(error))
"""


def refusal(act: Callable[[], object]) -> str:
    """What a ValueError says, in at most a few lines, or nothing."""
    try:
        act()
    except ValueError as error:
        return str(error) if len(str(error)) < 1000 else "refused at too great a length"
    return ""


@pytest.mark.parametrize("name", ["sweep.json", "data/cell-000001.parquet"])
def test_a_damaged_file_of_a_sweep_is_refused_by_name_or_read(tmp_path: Path, capsys, name: str):
    """Whoever reads the sweep, or goes on with it; nothing of the file is changed."""
    swept(tmp_path / "a")
    file, random, counts = tmp_path / "a" / name, np.random.default_rng(3), Counter[str]()
    whole, slowest = file.read_bytes(), 0.0
    for _ in range(COUNT):
        raw = mutated(whole, PIECES, random)
        file.write_bytes(raw)
        began = time.process_time()
        said = refusal(lambda: read_sweep(tmp_path / "a"))
        assert said == "" or str(tmp_path / "a") in said, said
        counts["refused" if said else "read"] += 1
        slowest = max(slowest, time.process_time() - began)
        assert file.read_bytes() == raw
    with capsys.disabled():
        print(f"\n{COUNT} damaged {name}: {dict(counts)}, at most {slowest:.2f} s")
    assert slowest < 5
    assert counts["refused"]


def test_a_sweep_written_to_hurt_is_refused(tmp_path: Path):
    swept(tmp_path / "a")
    about = json.loads((tmp_path / "a/sweep.json").read_text())
    for changes in (
        {"cells": 10**12}, {"cells": -1}, {"cells": 1e400}, {"cells": None}, {"cell": None},
        {"units": 3}, {"definition": []}, {"digest": "0"}, {"digest": None}, {"version": 10**400},
        {"cell": 10**30}, {"cells": "6" * 5000}, {"cell": 0},
        {"definition": {"axes": {}, "cases": [[]]}},
    ):  # fmt: skip
        text = json.dumps(about | changes).replace("Infinity", "1e400")
        (tmp_path / "a/sweep.json").write_text(text)
        for act in (read_sweep, lambda path: swept(path, resume=True)):
            said = refusal(lambda act=act: act(tmp_path / "a"))
            assert said or changes.keys() <= {"cell", "units", "definition"}, changes


def test_a_second_writer_is_refused_and_the_first_unharmed(tmp_path: Path):
    def begun(path: Path, how: str = "{}") -> subprocess.Popen[str]:
        words = [sys.executable, "-c", WRITER, str(path), how]
        return subprocess.Popen(words, stderr=subprocess.PIPE, text=True)

    alone = begun(tmp_path / "alone")
    assert alone.communicate()[1] is not None
    assert alone.returncode == 0
    first = begun(tmp_path / "both")
    while first.poll() is None and not list((tmp_path / "both").glob("data/*.parquet")):
        time.sleep(0.02)
    first.send_signal(signal.SIGSTOP)  # it holds the sweep for as long as the other tries
    other = begun(tmp_path / "both", "{'resume': True}")
    assert "another process is sweeping there" in other.communicate()[1]
    first.send_signal(signal.SIGCONT)
    assert first.communicate()[1] is not None
    assert first.returncode == 0
    assert read_sweep(tmp_path / "both").equals(read_sweep(tmp_path / "alone"))
