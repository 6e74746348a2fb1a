"""Evaluation: its numbers are the environment's, its intervals cover, its files are whole."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.agents import evaluate
from stickslip.agents.biped.controllers import ConstantTorque
from stickslip.agents.biped.measures import COLUMNS, MIN_DISTANCE, Episodes
from stickslip.agents.evaluation import table as statistics
from stickslip.agents.evaluation.rollout import episode_key, is_random, rollout
from stickslip.agents.ugv.episodes import UGVEpisodes, ugv_columns
from stickslip.dynamics import Scene, Status
from stickslip.dynamics.ugv import Track
from stickslip.envs import BipedEnv, Randomisation, UGVEnv
from tests.agents.networks import make_policy

ENV = BipedEnv()
STARTS = Randomisation(
    friction=(0.9, 1.1), mass=(0.9, 1.1), phase=(np.pi / 2, 3 * np.pi / 2), crank_rate=(0.0, 3.0)
)
SEEDS = (3, 4, 5, 6)


@pytest.fixture(scope="module")
def policy():
    return make_policy((6, 8, 1))


@pytest.fixture(scope="module")
def params():
    return ENV.make_params(randomisation=STARTS, time_limit=1.5)


@pytest.fixture(scope="module")
def table(policy, params):
    controllers = {"policy": policy, "push": ConstantTorque(-3.9), "rest": ConstantTorque(0.0)}
    firm = replace(params, scene=Scene.uniform(0.5, 0.4))
    return evaluate(ENV, controllers, {"slippery": params, "firm": firm}, seeds=SEEDS)


@pytest.mark.long
def test_totals_are_those_of_a_hand_run_loop(table, policy, params):
    env = replace(ENV, autoreset="disabled")
    episodes = table.row("slippery", "policy").episodes
    for index, seed in enumerate(SEEDS[:3]):
        obs, state = env.reset(episode_key(seed), params)
        sums, over, steps = np.zeros(4), False, 0
        while not over:
            action = policy(obs)
            obs, state, reward, terminated, truncated, info = env.step(
                jax.random.key(0), state, action, params
            )
            energy = info["positive_work"] + info["copper_loss"]
            sums += np.asarray([reward, info["walked"], info["slid"], energy], float)
            steps, over = steps + 1, bool(terminated | truncated)
        names = ("reward", "walked", "slid", "energy")
        found = [getattr(episodes, name)[index] for name in names]
        np.testing.assert_allclose(found, sums, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(episodes.duration[index], 0.02 * steps, rtol=1e-6)
        assert episodes.fell[index] == bool(terminated)


@pytest.mark.long
def test_rows_stand_still_after_the_end(params):
    played = rollout(ENV, ConstantTorque(-3.9), params, 3, 75)
    end = int(played.length)
    assert 0 < end < 75
    assert bool(played.terminated[end - 1])
    assert len(played.trimmed().reward) == end
    for leaf in jax.tree.leaves((played.state, played.info)):
        np.testing.assert_array_equal(leaf[end:], np.broadcast_to(leaf[end - 1], leaf[end:].shape))


def test_falls_are_counted_and_per_metre_numbers_need_a_distance(table):
    push, rest = table.row("firm", "push"), table.row("firm", "rest")
    assert push.metrics["falls"].value > 0.5
    assert rest.episodes.walked.mean() < MIN_DISTANCE
    assert np.isnan(rest.metrics["slip_per_metre"].value)
    assert "| - | - | - |" in table.shown().markdown()
    with pytest.raises(ValueError, match="slippery/policy"):
        table.row("moon", "policy")


def test_files_hold_the_table(table, tmp_path):
    text = table.write_csv(tmp_path / "table.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    assert [(row["scene"], row["controller"]) for row in rows] == [
        (row.scene, row.controller) for row in table.rows
    ]
    np.testing.assert_allclose(float(rows[0]["return"]), table.rows[0].metrics["return"].value)
    assert rows[-1]["slip_per_metre"] == ""
    path = table.write_json(tmp_path / "deep" / "table.json", {"commit": "abc"})
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["commit"] == "abc"
    assert content["seeds"] == list(SEEDS)
    assert content["rows"][-1]["metrics"]["slip_per_metre"]["value"] is None
    assert len(content["rows"][0]["per_episode"]["reward"]) == len(SEEDS)
    assert len(list(tmp_path.glob("**/*"))) == 3, "no temporary file stays behind"


def test_intervals_cover_about_95_percent():
    rng = np.random.default_rng(1)
    trials, n = 2000, 8
    above, below = rng.normal(3, 1, (trials, n)), rng.uniform(0.5, 1.5, (trials, n))
    means = [statistics.mean_interval(row) for row in above]
    assert 0.935 < np.mean([i.low <= 3 <= i.high for i in means]) < 0.965
    slopes = [statistics.ratio_interval(a * b, b, 0.1) for a, b in zip(above, below, strict=True)]
    assert 0.91 < np.mean([i.low <= 3 <= i.high for i in slopes]) < 0.97
    fell = (rng.uniform(size=(trials, 20)) < 0.1).sum(axis=1)
    of_20 = [statistics.fraction_interval(np.arange(20) < count) for count in range(21)]
    assert np.mean([of_20[count].low <= 0.1 <= of_20[count].high for count in fell]) > 0.93


def test_every_episode_weighs_alike_and_costs_are_of_drives_that_reached_the_end():
    walks = Episodes(
        reward=np.array([3.0, 1.0]),
        duration=np.array([10.0, 2.0]),
        turned=np.array([30.0, 5.0]),
        walked=np.array([6.0, 1.0]),
        slid=np.array([0.2, 0.0]),
        energy=np.array([40.0, 9.0]),
        weight=np.array([80.0, 80.0]),
        status=np.array([Status.OK, Status.TOPPLE]),
    )
    of_walks = {name: of(walks).value for name, (_, of) in COLUMNS.items()}
    assert of_walks["mean_speed"] == pytest.approx((0.6 + 0.5) / 2)
    assert of_walks["mean_crank_rate"] == pytest.approx((3.0 + 2.5) / 2)
    assert of_walks["slip_per_metre"] == pytest.approx(0.2 / 7)
    assert of_walks["cost_of_transport"] == pytest.approx(49 / (80 * 7))
    assert of_walks["falls"] == 0.5
    three = np.array([2.0, 4.0, 9.0])
    ends = np.array([Status.OK, Status.OK, Status.WHEEL_SLIP])
    drives = UGVEpisodes(three, three, *[three] * 4, ends)
    of_drives = {name: of(drives).value for name, (_, of) in ugv_columns("J").items()}
    assert of_drives["return"] == pytest.approx(5.0)
    assert of_drives["cost"] == of_drives["wheel_energy"] == pytest.approx(3.0)
    assert of_drives["failures"] == pytest.approx(1 / 3)


def test_whatever_a_reset_draws_makes_episodes_differ():
    class Blurred(BipedEnv):
        def reset_env(self, key, params):
            obs, state = super().reset_env(key, params)
            return obs + 0.1 * jax.random.normal(key, obs.shape), state

    grounds = (UGVEnv().make_params(track=Track.bump(), preview_noise=n) for n in (None, 0.05))
    assert [is_random(UGVEnv(), params) for params in grounds] == [False, True]
    assert not is_random(ENV, ENV.default_params)
    assert is_random(Blurred(), ENV.default_params)
