"""Bounds that were proved before: of the problems that episodes pose, and true ones."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from stickslip.agents.evaluation.rollout import first_state
from stickslip.agents.ugv import proved as module
from stickslip.agents.ugv.plans import Optimum
from stickslip.agents.ugv.proved import named_problem, proved
from stickslip.dynamics.ugv import Track
from stickslip.dynamics.ugv.ground.surface import Surface
from stickslip.envs.ugv.env import UGVEnv
from stickslip.optim import PostureProblem
from stickslip.optim.posture.bounds import bound_every_drive

ROWS = json.loads(module.FILE.read_text(encoding="utf-8"))["rows"]


def test_an_episode_over_a_named_track_is_the_problem_that_was_proved():
    env = UGVEnv()
    for track in ("bump", "step"):
        params = env.make_params(track=Track.named(track))
        problem = env.problem(first_state(env, params, 0), params)
        row = next(r for r in ROWS if (r["track"], r["criterion"]) == (track, "wheel_energy"))
        assert proved(problem) == pytest.approx(row["bound"], rel=1e-3)
        assert proved(problem) < row["bound"]
    for change in ({"friction": 0.7}, {"leg_rate": 0.9}, {"track": Track.bump(0.31)}):
        other = env.make_params(**({"track": Track.bump()} | change))
        assert np.isnan(proved(env.problem(first_state(env, other, 0), other)))


def test_other_ground_and_wheels_that_may_overlap_are_other_problems():
    usual = named_problem("bump", "wheel_energy")
    assert np.isnan(proved(replace(usual, solver=replace(usual.solver, overlap=True))))
    assert np.isfinite(proved(usual))
    surface = Surface.patches([4.0], [1.0, 1.25])
    assert np.isnan(proved(replace(usual, track=replace(usual.track, surface=surface))))


def _quick_of(rows):
    """One now; the others are further grounds and programs."""
    quick = ("bump", "wheel_energy")
    return [
        pytest.param(
            row,
            id=f"{row['track']} {row['criterion']}",
            marks=() if (row["track"], row["criterion"]) == quick else pytest.mark.long,
        )
        for row in rows
    ]


@pytest.mark.parametrize("row", _quick_of(ROWS))
def test_legs_straight_cost_no_less(row):
    problem = named_problem(row["track"], row["criterion"])
    assert problem.objective(np.full(problem.n, np.pi / 2)) >= row["bound"] - 1e-9


@pytest.mark.long
@pytest.mark.parametrize("track", ["flat", "bump", "step"])
def test_what_is_stored_is_proved_again(track, float64):
    problem = named_problem(track, "wheel_energy")
    row = next(r for r in ROWS if (r["track"], r["criterion"]) == (track, "wheel_energy"))
    drive = None
    if track != "flat":
        env = UGVEnv()
        params = env.make_params(track=Track.named(track))
        drive = Optimum(31, polish=True).solve(env, params, first_state(env, params, 0)).x
    found = bound_every_drive(problem, drive, cells=42 if drive is not None else 8)
    assert found.value >= row["bound"] * (1 - module.ROUNDING)


def test_other_solvers_and_problems_have_no_bound():
    assert np.isnan(proved(PostureProblem.along("bump", leg_rate=2.0)))
    assert np.isnan(proved(PostureProblem.along("bump", leg_rate=1.0)))


@pytest.mark.parametrize(
    "text", ["", "[]", '{"format": "stickslip proved bounds", "version": 2, "rows": []}',
             '{"format": "stickslip proved bounds", "version": 1, "rows": [{"track": "bump", '
             '"criterion": "wheel_energy", "bound": NaN}]}'],
)  # fmt: skip
def test_a_damaged_file_is_named(monkeypatch, tmp_path, text: str):
    path = tmp_path / "proved.json"
    path.write_text(text)
    monkeypatch.setattr(module, "FILE", path)
    with pytest.raises(ValueError, match=r"proved\.json"):
        proved(named_problem("bump", "wheel_energy"))
