"""A few of a sweep's episodes are found again in its data, and played again as they were."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import read_sweep, sweep, sweep_arrays
from stickslip.agents.reports.swept import write_report
from stickslip.agents.sweeps.design import design_of
from stickslip.agents.sweeps.files.directory import read_about
from stickslip.agents.sweeps.named import played_on
from stickslip.agents.sweeps.plan import Plan
from stickslip.agents.sweeps.telling import again as replaying
from stickslip.agents.sweeps.telling.again import play_again
from stickslip.agents.sweeps.telling.chosen import chosen_of
from stickslip.envs.rendering.html.reading import read_episodes
from tests.agents.sweeps.masses import TASK, WHO

AXES = {"mu": [0.1, 0.3], "force_limit": [12.0, 150.0, 3000.0]}


def swept(path: Path, summaries: bool) -> Plan:
    """2 policies at 6 points, some of which throw the mass out, in several chunks; its plan."""
    how = {"episodes": 4, "independent": True, "summaries": summaries}
    sweep(TASK, WHO, AXES, out=path, chunk=6, tile=4, report=False, **how)
    plan = Plan.of(*played_on(TASK, WHO), design_of(AXES, None, 0), **how)
    return replace(plan, layout=read_about(path).layout)


def test_the_extremes_the_median_and_a_failure_come_out_as_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    plan = swept(tmp_path, summaries=False)
    found, rows = sweep_arrays(tmp_path, summaries=True), read_sweep(tmp_path)
    returns, fell = np.asarray(rows["reward"]), np.asarray(rows["fell"])
    least, greatest, median, failed = chosen = chosen_of(tmp_path, plan, found)
    assert least.recorded == returns.min()
    assert greatest.recorded == returns.max()
    assert failed.recorded == returns[fell].max() < greatest.recorded
    means = np.sort(found["reward_mean"], axis=None)
    at = found["reward_mean"].reshape(2, 6)[median.case, median.point]
    assert at == means[(means.size - 1) // 2]
    again = play_again(plan, chosen)
    assert [one.chosen for one in again] == chosen
    for one in again:
        assert one.apart is not None
        assert abs(one.apart) <= one.rounding < 1e-3
        assert one.axes["force_limit"] == one.params.force_limit
        assert bool(one.played.trimmed().terminated[-1]) == fell[returns == one.chosen.recorded][0]
    wrong = play_again(plan, [least._replace(recorded=least.recorded + 1)])
    assert wrong[0].apart == pytest.approx(-1, abs=1e-3)
    monkeypatch.setattr(replaying, "play_again", lambda plan, chosen: wrong)
    monkeypatch.setattr("stickslip.agents.reports.swept.play_again", replaying.play_again)
    text = write_report(plan, tmp_path, found, "").read_text(encoding="utf-8")
    assert "no: -1" in text
    assert "roundings grew" in text


def test_of_summaries_the_points_are_ranked_and_nothing_is_claimed(tmp_path: Path):
    plan = swept(tmp_path, summaries=True)
    found = sweep_arrays(tmp_path)
    chosen = chosen_of(tmp_path, plan, found)
    assert {(one.seed, one.recorded) for one in chosen} == {(0, None)}
    means = found["reward_mean"].reshape(2, 6)
    assert means[chosen[0].case, chosen[0].point] == means.min()
    path = write_report(plan, tmp_path, found, "")
    shown = [one.name.partition(":")[0] for one in read_episodes(path)]
    assert shown == ["least return", "greatest return", "median return", "failed"]
    assert "its point has a summary alone" in path.read_text(encoding="utf-8")
