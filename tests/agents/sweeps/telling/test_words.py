"""What is said and drawn of a sweep is what its numbers say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import SweepArrays
from stickslip.agents.sweeps.telling.compare import (
    common,
    compare_in_words,
    compare_table,
    summary_of,
)
from stickslip.agents.sweeps.telling.pictures import write_pictures
from stickslip.agents.sweeps.telling.regions import where
from stickslip.agents.sweeps.telling.told import PLAINLY, Told
from stickslip.agents.sweeps.telling.views import view_of
from stickslip.agents.sweeps.telling.words import in_words, summary_table

MU = np.array([0.02, 0.04, 0.06, 0.1, 0.2])
LOAD = np.array([0.0, 5.0, 10.0])
FALLS = Told(slip=("slid", "walked"), fails="falls", failures="falls")


def made(returns: np.ndarray, falls: np.ndarray, slid: np.ndarray, who=("a", "b")) -> SweepArrays:
    """Summaries of 10 episodes a point; arrays [policies, mu, load]."""
    shape = (1, *returns.shape)
    arrays = {
        "episodes": np.full(shape, 10),
        "falls": falls.reshape(shape),
        "topple": falls.reshape(shape),
        "ok": 10 - falls.reshape(shape),
        "reward_mean": returns.reshape(shape),
        "reward_std": np.ones(shape),
        "slid_mean": slid.reshape(shape),
        "walked_mean": np.full(shape, 2.0),
    }
    labels = {"task": np.array(["ice"]), "policy": np.array(who), "mu": MU, "payload": LOAD}
    return SweepArrays(("task", "policy", "mu", "payload"), labels, arrays, {"payload": "kg"})


def example() -> SweepArrays:
    """a falls at low mu with a load, and earns more from mu = 0.1 on; b slides without a load."""
    returns = np.ones((2, 5, 3))
    returns[0, 3:] = 4.0
    returns[1, :2] = 9.0
    falls = np.zeros((2, 5, 3), int)
    falls[0, :2, 1:] = 8
    slid = np.zeros((2, 5, 3))
    slid[1, :, 0] = 0.5
    return made(returns, falls, slid)


def test_words_say_where_it_falls_and_slips_and_who_is_best():
    text = " ".join(in_words(example(), FALLS).split())
    assert "falls in 21 % of the episodes, most where mu up to 0.04, payload from 5 kg on" in text
    assert "; 100 % of them topple" in text
    assert "b mean return 4.2; never falls" in text
    assert "slides by more than 1 cm a metre at 33 % of the points, most where payload = 0" in text
    assert "at worst 0.25 m a metre" in text
    assert "best by return: a at 40 % of the points, most where mu from 0.1 on" in text
    assert "best by return: b at 40 % of the points, most where mu up to 0.04" in text
    assert "no best told from the next at 20 % of the points" in text


def test_a_drive_that_ends_early_fails_and_does_not_fall():
    text, table = in_words(example()), summary_table(example())
    assert "a  mean return 2.2; fails in 21 % of the episodes" in text
    assert "never fails" in text
    assert "fall" not in text
    assert "failures" in [column.name for column in table.columns]


def test_a_region_in_the_middle_and_one_nowhere():
    found = example()
    shares = np.zeros((5, 3))
    shares[1:4] = 1.0
    assert where(shares, found.dims[2:], found) == "mu from 0.04 to 0.1"
    assert where(np.ones((5, 3)), found.dims[2:], found) == ""
    assert where(np.zeros((5, 3)), found.dims[2:], found) == ""


def alone_at_points(drawn: tuple[str, ...] | None) -> SweepArrays:
    """One episode at each point, b earning the more everywhere."""
    one = example()
    arrays = {n: np.minimum(one[n], 1) for n in ("episodes", "falls", "topple", "ok")}
    returns = np.stack([np.zeros((5, 3)), np.ones((5, 3))])[None]
    arrays |= {"reward_mean": returns, "reward_std": np.full(returns.shape, np.nan)}
    return SweepArrays(one.dims, one.coordinates, arrays, one.units, drawn)


@pytest.mark.parametrize(
    ("drawn", "apart", "said"),
    [
        ((), 1.0, "no reset draws anything: every difference is real"),
        (("ice",), 0.0, "one episode a point, and resets draw: nothing is told apart"),
        (None, 0.0, "whether resets draw is not known: nothing is told apart"),
    ],
)
def test_one_episode_tells_policies_apart_only_where_nothing_is_drawn(drawn, apart, said):
    found = alone_at_points(drawn)
    text = in_words(found)
    assert said in text
    assert ("best by return: b at 100 %" in text) == bool(apart)
    assert ("no best told from the next at 100 %" in text) == (not apart)
    column = [one.name for one in summary_table(found).columns].index("best_told_apart")
    assert [row[column] for row in summary_table(found).rows] == [0.0, apart]
    words = compare_in_words(common(found, found), PLAINLY)
    assert said in words
    table = summary_of(common(found, alone_at_points(drawn)), PLAINLY)
    assert [row[5] for row in table.rows] == [1.0, 1.0]  # the same twice


def random_axes() -> SweepArrays:
    drawn = np.random.default_rng(0).uniform(size=(2, 64))
    fell = (drawn[0] < 0.25).astype(int)
    arrays = {
        "episodes": np.ones((1, 1, 64), int),
        "falls": fell.reshape(1, 1, 64),
        "reward_mean": drawn[0].reshape(1, 1, 64),
        "reward_std": np.full((1, 1, 64), np.nan),
    }
    labels = {"task": np.array(["t"]), "policy": np.array(["p"]), "sample": np.arange(64)}
    labels |= {"x": drawn[0], "y": drawn[1]}
    return SweepArrays(("task", "policy", "sample"), labels, arrays, {})


def test_random_axes_are_told_of_by_their_own_values():
    text = in_words(random_axes())
    assert "most where x up to 0." in text
    assert "y" not in text.partition("most where")[2]


def two_tasks() -> SweepArrays:
    one = example()
    arrays = {name: np.concatenate([value, value]) for name, value in one.arrays.items()}
    return SweepArrays(one.dims, one.coordinates | {"task": np.array(["s", "t"])}, arrays, {})


def one_axis() -> SweepArrays:
    one = example()
    arrays = {name: value[..., 0] for name, value in one.arrays.items()}
    labels = {name: value for name, value in one.coordinates.items() if name != "payload"}
    return SweepArrays(one.dims[:3], labels, arrays, {})


@pytest.mark.parametrize(
    ("found", "files"),
    [
        (example(), ["sweep.png", "endings.png"]),
        (one_axis(), ["sweep.png"]),
        (random_axes(), ["sweep.png"]),
        (two_tasks(), ["sweep-1.png", "endings-1.png", "sweep-2.png", "endings-2.png"]),
    ],
)
def test_pictures_are_drawn_of_grids_lines_and_samples(tmp_path: Path, found, files):
    written = write_pictures(found, tmp_path, FALLS)
    assert [one.name for one in written] == files
    assert all(one.read_bytes()[:4] == b"\x89PNG" for one in written)


def test_nothing_is_drawn_where_nothing_varies(tmp_path: Path):
    found = one_axis()
    arrays = {name: value[:, :, 0] for name, value in found.arrays.items()}
    single = SweepArrays(("task", "policy"), found.coordinates, arrays, {})
    assert view_of(single) is None
    assert write_pictures(single, tmp_path, PLAINLY) == []
    assert "mean return" in in_words(single)


def test_two_sweeps_are_compared_where_both_have_points():
    one = example()
    better = one.arrays["reward_mean"][0].copy()
    better[0, 4] += 3.0
    other = made(better, one["falls"][0], one["slid_mean"][0])
    arrays = {name: value[:, :, 1:] for name, value in other.arrays.items()}
    fewer = SweepArrays(other.dims, other.coordinates | {"mu": MU[1:]}, arrays, other.units)
    both = common(one, fewer)
    text = compare_in_words(both, FALLS)
    assert "12 points that both have" in text
    assert "B earns more at 25 % of the points, most where mu = 0.2; by 3 at most" in text
    assert text.count("not told apart at 100 % of the points") == 1
    table = compare_table(both, FALLS)
    assert len(table.rows) == 24
    assert [column.title for column in table.columns][:4] == [
        "task",
        "policy",
        "mu",
        "payload [kg]",
    ]


def test_policies_and_sweeps_are_told_apart_by_differences_on_the_same_episodes():
    """b earns 0.1 more than a in each episode, and episodes differ by far more than that."""
    rng = np.random.default_rng(0)
    tracks = rng.normal(0.0, 5.0, (1, 5, 3, 10))
    returns = np.stack([tracks, tracks + 0.1 + rng.normal(0.0, 0.02, tracks.shape)], 1)
    one = example()
    arrays = one.arrays | {"reward_mean": returns.mean(-1), "reward_std": returns.std(-1, ddof=1)}
    found = replace(one, arrays=arrays, returns=returns)
    assert "best by return: b at 100 % of the points" in in_words(found)
    assert "no best told from the next at 100 %" in in_words(replace(found, returns=None))
    moved = arrays | {"reward_mean": arrays["reward_mean"] + 0.1}
    other = replace(found, arrays=moved, returns=returns + 0.1)
    heads = [column.name for column in summary_of(common(found, other), PLAINLY).columns]
    for kept, share in ((found, 1.0), (replace(found, returns=None), 0.0)):
        for row in summary_of(common(kept, other), PLAINLY).rows:
            assert row[heads.index("B_earns_more")] == share


def test_sweeps_that_share_nothing_are_refused():
    one = example()
    far = SweepArrays(one.dims, one.coordinates | {"mu": MU + 1}, one.arrays, one.units)
    with pytest.raises(ValueError, match=r"no mu that both have: 0\.02, 0\.04, .* and 1\.02"):
        common(one, far)
    with pytest.raises(ValueError, match="axes mu, payload and mu; accepted"):
        common(one, one_axis())
    drawn = random_axes()
    moved = SweepArrays(
        drawn.dims, drawn.coordinates | {"x": drawn.coordinates["x"] + 1}, drawn.arrays, {}
    )
    with pytest.raises(ValueError, match="random axis x drew other values"):
        common(drawn, moved)


def test_one_policy_in_each_is_compared_whatever_it_is_called():
    shape = np.ones((1, 5, 3))
    a, b = (
        made(shape * k, shape.astype(int), shape, who=(who,)) for k, who in ((1, "x"), (3, "y"))
    )
    text = compare_in_words(common(a, b), PLAINLY)
    assert "policy: x in A, y in B" in text
    assert "B earns more at 100 % of the points" in text
