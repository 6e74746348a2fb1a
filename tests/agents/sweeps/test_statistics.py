"""Summaries and plots of a sweep against what can be worked out by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import SweepArrays
from stickslip.agents.sweeps.data import Panel, _maps, drawn_axes, summary_table, write_pictures
from stickslip.agents.sweeps.plan import ENDINGS
from stickslip.envs.rendering.sheet import make_sheet

MU, LOAD, EPISODES = np.array([0.02, 0.04, 0.08, 0.16, 0.32]), np.array([0.0, 5.0, 10.0]), 8


def example() -> SweepArrays:
    """Policy a fails at low mu with a load, b below 0.08; a earns more from mu = 0.16 on."""
    luck = 100 * np.random.default_rng(0).normal(size=EPISODES)
    noise = 0.01 * np.random.default_rng(1).normal(size=(2, 5, 3, EPISODES))
    returns = luck + noise
    returns[0, 3:] += 3.0
    returns[1, :2] += 8.0
    fell = np.zeros(returns.shape, bool)
    fell[0, :2, 1:] = True
    ending = np.where(fell, ENDINGS.index("topple"), 0)
    arrays = {"reward": returns, "fell": fell, "ending": ending, "slid": fell + 0.5}
    arrays["walked"] = np.full(returns.shape, 2.0)
    labels = {"task": np.array(["ice"]), "policy": np.array(["a", "b"]), "mu": MU, "payload": LOAD}
    labels["seed"] = np.arange(EPISODES)
    arrays = {name: one[None] for name, one in arrays.items()}
    dims = ("task", "policy", "mu", "payload", "seed")
    return SweepArrays(dims, labels, arrays, {}, ("ice",))


def test_a_summary_has_failures_and_the_worst_slip_over_all_points():
    table = summary_table(example(), ("slid", "walked"))
    rows = [dict(zip([one.name for one in table.columns], row, strict=True)) for row in table.rows]
    assert [row["failures"] for row in rows] == pytest.approx([4 / 15, 0])
    assert [row["slip_worst"] for row in rows] == pytest.approx([0.75, 0.25])
    assert rows[0]["points"] * EPISODES == rows[0]["episodes"] == 120


@pytest.mark.parametrize("axes", [2, 1])
def test_a_plot_is_drawn_of_what_varies(tmp_path: Path, axes: int):
    found = example()
    if axes == 1:
        keep = {name: one[:, :, :, :1] for name, one in found.arrays.items()}
        keep["fell"] = np.array(keep["fell"])
        keep["fell"][0, 0, 0] = True
        keep["ending"] = np.where(keep["fell"], ENDINGS.index("topple"), 0)
        found = replace(found, arrays=keep, coordinates=found.coordinates | {"payload": LOAD[:1]})
    assert drawn_axes(found) == ("mu", "payload")[:axes]
    names = [one.name for one in write_pictures(found, tmp_path, ("slid", "walked"))]
    assert names == ["sweep.png"]
    assert (tmp_path / "sweep.png").stat().st_size > 10_000


def test_maps_of_one_value_have_one_colour():
    figure, axes = make_sheet(1, 2, (6, 3), "")
    _maps(figure, axes, Panel("failures [%]", np.zeros((2, 5, 3))), MU, LOAD)
    assert [axis.collections[0].get_clim() for axis in axes] == [(0, 1), (0, 1)]
