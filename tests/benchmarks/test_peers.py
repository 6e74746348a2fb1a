"""Walks in other programs, and the table of their speed."""

import numpy as np
import pytest

from benchmarks.peers import __main__ as command
from benchmarks.peers.programs import error_of
from benchmarks.report import RESULTS, read_json
from stickslip.agents.exchange.files import Settings
from tests.documents import ROOT

pytestmark = pytest.mark.long


def test_the_page_has_the_fastest_settings_that_meet_each_bound():
    content = read_json(ROOT / RESULTS / "peers.json")
    page = (ROOT / command.DOCUMENT).read_text(encoding="utf-8")
    assert f"<!-- peers -->\n{command.body(content)}\n<!-- end of peers -->" in page
    row = {"program": "MuJoCo", "case": "stick", "setting": "RK4, 1 ms", "batch": 1}
    pairs = [(1e-1, 90.0), (5e-3, 9.0), (9e-3, 11.0), (1e-5, 1.0)]
    (line,) = command.at_bounds([row | {"error": e, "core_rate": rate} for e, rate in pairs])
    assert line["0.01 rad"] == "11 (RK4, 1 ms)"
    assert line["1e-06 rad"] == "not reached (1.0e-05)"
    assert error_of([1.0, np.nan], [1.0, 1.0]) == np.inf


def test_mujoco_walks_as_we_do(float64):
    pytest.importorskip("mujoco")
    from benchmarks.peers.programs import mujoco_walk

    settings = Settings(0.79 / 800, "RK4", (0.5 * 0.79 / 800, 1.0))
    found = mujoco_walk("stick", settings)()[0]
    # exact functions, float64, steps of 0.1 ms (benchmarks.peers.programs.reference)
    assert found[4] == pytest.approx(2.91477155, abs=1e-5)
    assert found[-1] == pytest.approx(4.49633265, abs=2e-4)
