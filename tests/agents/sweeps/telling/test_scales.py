"""Pictures of a sweep show the values that were played, and one point hides no other."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from stickslip.agents import SweepArrays
from stickslip.agents.sweeps.telling import endings, pictures
from stickslip.agents.sweeps.telling.scales import (
    HIGH,
    WIDE,
    colours_of,
    edges,
    labels,
    plain_number,
    scale_axis,
    ticks,
)
from stickslip.agents.sweeps.telling.told import PLAINLY
from stickslip.agents.sweeps.telling.views import view_of


@pytest.mark.parametrize(
    ("values", "log", "shown"),
    [
        ([0.0, 5.0], False, "0 5"),
        ([0.05, 0.1, 0.2], True, "0.05 0.1 0.2"),
        (np.linspace(0.02, 0.2, 5), False, "0.02 0.065 0.11 0.155 0.2"),
        (np.linspace(0.02, 0.3, 64), False, "0.05 0.1 0.15 0.2 0.25 0.3"),
        (np.geomspace(0.02, 0.3, 64), True, "0.02 0.05 0.1 0.2"),
        ([-30000.0, 10.0], False, "−30000 10"),
        ([1000.0, 1001.0], False, "1000 1001"),
        ([0.3], False, "0.3"),
    ],
)
def test_ticks_are_the_values_where_they_are_few_and_within_them_else(values, log, shown):
    values = np.asarray(values)
    found = ticks(values, log, WIDE, True)
    assert " ".join(labels(found)) == shown
    assert values.min() <= found.min() <= found.max() <= values.max()
    assert len(ticks(values, log, HIGH, False)) >= len(found)


def test_no_label_has_a_power_of_ten_and_no_tick_is_beside_the_values():
    axes = Figure().subplots()
    values = np.array([0.05, 0.1, 0.2])
    axes.pcolormesh(edges(values), edges(np.array([0.0, 5.0])), np.zeros((2, 3)))
    scale_axis(axes, "x", values)
    scale_axis(axes, "y", np.array([0.0, 5.0]))
    axes.figure.canvas.draw()
    assert axes.get_xscale() == "log"
    assert [one.get_text() for one in axes.get_xticklabels()] == ["0.05", "0.1", "0.2"]
    assert [one.get_text() for one in axes.get_yticklabels()] == ["0", "5"]
    assert not axes.get_xticks(minor=True).size
    assert axes.get_ylim() == (-2.5, 7.5)  # half a cell


def test_a_penalty_is_left_to_the_arrow_of_the_bar():
    values, calm = np.array([1.0, 2, 3, 4, 5, -30000]), np.array([1, 1, 1, 1, 1, 0], bool)
    for known in (calm, np.zeros(6, bool)):
        found = colours_of(values, known, None)
        assert (found.low, found.high, found.extend) == (1.0, 5.0, "min")
        assert found.words == "arrow: down to −30000"
    many = np.array([*np.linspace(1, 5, 8), *np.full(5, -30000.0)])
    assert colours_of(many, many > 0, None).low == 1.0
    usual = colours_of(np.linspace(-3, 5, 20), np.ones(20, bool), None)
    assert (usual.low, usual.high, usual.extend, usual.words) == (-3.0, 5.0, "neither", "")


def test_colours_of_one_value_alone_have_a_scale():
    none = colours_of(np.zeros(6), np.ones(6, bool), 0.0, 1.0)
    assert (none.low, none.high) == (0.0, 1.0)
    same = colours_of(np.full(6, 3.0), np.ones(6, bool), None)
    assert same.low < 3.0 < same.high
    unknown = colours_of(np.full(6, np.nan), np.zeros(6, bool), 0.0, 0.01)
    assert (unknown.low, unknown.high) == (0.0, 0.01)
    assert plain_number(1e-9) == "1e−09"


def lines(falls: int) -> SweepArrays:
    """A policy over three frictions, 10 episodes each; `falls` of them at the first."""
    fell = np.array([[[falls, 0, 0]]])
    arrays = {"episodes": np.full((1, 1, 3), 10), "falls": fell, "topple": fell}
    arrays |= {"reward_mean": np.ones((1, 1, 3)), "reward_std": np.ones((1, 1, 3))}
    names = {"task": np.array(["t"]), "policy": np.array(["p"]), "mu": np.array([0.02, 0.04, 0.3])}
    return SweepArrays(("task", "policy", "mu"), names, arrays, {}, ("t",))


def drawn(module, monkeypatch: pytest.MonkeyPatch, draw) -> Figure:
    """The figure that would be saved."""
    kept: list[Figure] = []
    monkeypatch.setattr(module, "save_sheet", lambda figure, path: kept.append(figure))
    draw()
    return kept[0]


@pytest.mark.parametrize("falls", [0, 1, 10])
def test_failures_are_neither_drawn_below_none_nor_above_all(tmp_path, monkeypatch, falls: int):
    found = lines(falls)
    view = view_of(found)
    assert view is not None
    figure = drawn(
        pictures,
        monkeypatch,
        lambda: pictures._measures(found, 0, "t", view, PLAINLY, tmp_path / "a.png"),
    )
    returns, failures = figure.axes
    low, high = failures.get_ylim()
    assert low == 0
    assert max(1, 10 * falls) <= high <= 100
    for band in failures.collections:
        edge = band.get_paths()[0].vertices[:, 1]
        assert edge.min() >= 0
        assert edge.max() <= 100
    assert bool(failures.collections) == (falls == 1)
    named = [one.get_text() for one in returns.get_legend().get_texts()]
    assert named == ["p", "95 % interval of the mean"]


def test_bars_of_endings_stand_at_the_values_and_nowhere_else(tmp_path, monkeypatch):
    found = lines(4)
    view = view_of(found)
    assert view is not None
    figure = drawn(
        endings,
        monkeypatch,
        lambda: endings.draw_endings(found, 0, "t", view, tmp_path / "a.png"),
    )
    (axes,) = figure.axes
    spans = [(one.get_x(), one.get_x() + one.get_width()) for one in axes.patches]
    assert all(any(low < mu < high for mu in found.coordinates["mu"]) for low, high in spans)
    assert min(low for low, _ in spans) > 0.01  # half a cell below the first value
    assert axes.get_facecolor() != endings.GOES_ON
    heights = sorted(round(one.get_height()) for one in axes.patches)
    assert heights == [0, 0, 40, 60, 100, 100]
