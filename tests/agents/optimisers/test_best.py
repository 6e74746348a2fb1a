"""The best points of a race are evaluated again and played by the machine that they are of."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stickslip.agents.optimisers.best import MOST_SHOWN, best_of
from stickslip.agents.reports.raced import write_race
from stickslip.agents.ugv.machine import UGVMachine
from stickslip.envs.rendering.html.data import Line, Panel, Shown
from stickslip.envs.rendering.html.reading import read_episodes
from stickslip.optim import suite
from stickslip.optim.instances.instance import Instance
from tests.agents.optimisers.table import BEST, NAME, run

DRIVE = "ugv-bump-energy-d8-v2"


def found(name: str, gap: float, **given: Any):
    return replace(run([(3, gap)], 9, name=name, **given), point=suite()[name].known.x)


def test_the_page_has_the_best_gait_and_what_became_of_its_value(tmp_path):
    true, wrong = found(NAME, 0.0), found(NAME, -1e-4, method="liar")
    say: list[str] = []
    page = write_race([found(NAME, 0.5, seed=1), true], tmp_path, (), say=say.append)
    assert say == [f"playing the best of {NAME}, to be shown"]
    (walk,) = read_episodes(page)
    assert walk.name == f"{NAME} by mine"
    assert walk.facts[:2] == (("time", f"{BEST:.6g} s"), ("seed", "0"))
    assert walk.samples * walk.period == pytest.approx(3 * BEST, rel=0.01)  # three steps
    text = page.read_text(encoding="utf-8")
    assert "but for roundings" in text or "to the last bit" in text
    with pytest.raises(ValueError, match=r"report\.html exists"):
        write_race([true], tmp_path, ())
    (best,), _ = best_of([true, wrong])
    assert best.run is wrong
    assert not best.same
    assert best.apart == pytest.approx(1e-4 * BEST, rel=0.1)
    write_race([wrong], tmp_path, (), overwrite=True)
    assert f"no: {best.apart:+.2g}" in page.read_text(encoding="utf-8")


def test_without_points_the_page_says_why_nothing_plays(tmp_path):
    page = write_race([run([(3, 0.1)], 9)], tmp_path, ()).read_text(encoding="utf-8")
    assert "No episode is shown: the runs hold no points" in page


def test_families_take_turns_and_the_rest_is_counted(monkeypatch):
    line = Panel("torque", "N m", (Line("torque", np.zeros(3)),))
    shown = Shown("drive", 1.0, (line,))
    monkeypatch.setattr(UGVMachine, "solved", lambda self, problem, x, name: shown)
    postures = [name for name, one in suite("posture").items() if one.n <= 64]
    monkeypatch.setattr(Instance, "value", lambda self, x: (np.zeros(1), True))
    runs = [found(name, 0.1) for name in [*postures[:8], NAME]]
    best, more = best_of(runs)
    assert len(best) == MOST_SHOWN
    assert more == 3
    assert best[1].run.instance == NAME


@pytest.mark.long
def test_a_drive_is_played_waypoint_by_waypoint():
    one = suite()[DRIVE]
    whole = one.problem.free.expand(one.known.x)
    shown = UGVMachine().solved(one.problem, whole, "drive")
    assert shown is not None
    assert shown.samples == len(one.problem.x)
    cost = next(each for each in shown.panels if each.title == "wheel energy")
    assert cost.lines[0].values[-1] == pytest.approx(one.best_known, rel=1e-5)
    gait = suite()[NAME]
    assert UGVMachine().solved(gait.problem, gait.known.x, "gait") is None


@pytest.mark.long
@pytest.mark.parametrize("name", ["shoot-slippery-d10-v1", "gains-rate3-d2-v1"])
def test_walks_are_simulated_again(name: str):
    one = suite()[name]
    (best,), _ = best_of([found(name, 0.0)])
    assert best.same
    shown = best.shown
    assert shown.drawing is not None
    assert shown.states == ("STICK", "SLIP")
    torque = shown.panels[0].lines[0].values[1:]
    if one.family == "shooting":
        np.testing.assert_array_equal(torque, np.repeat(one.known.x, 5))
    slips = [event for event in shown.events if event.kind == "slip"]
    assert bool(slips) == bool(shown.slips.any())
