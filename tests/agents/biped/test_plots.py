"""The biped's plots say what they draw: friction in a panel each, controllers by one name."""

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.agents.biped.names import BIPED_BASELINES
from stickslip.agents.biped.pictures import plots
from stickslip.agents.biped.pictures.histories import Histories
from stickslip.agents.ugv.names import UGV_BASELINES
from stickslip.dynamics import Scene


def course(use: float) -> Histories:
    """Twenty steps in which the foot slid forwards and back."""
    time = np.arange(1, 21) / 50
    ones = np.ones_like(time)
    return Histories(
        time=time,
        torque=ones,
        crank_rate=3 * ones,
        momentum=ones,
        friction_use=use * ones,
        slid=time / 100,
        sliding=time > 0.2,
        commanded_rate=3.0,
        cruise=2.0,
    )


def test_each_controller_s_friction_has_a_panel_of_its_own(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    sheets, make = [], plots.make_sheet
    monkeypatch.setattr(plots, "make_sheet", lambda *how: sheets.append(make(*how)) or sheets[-1])
    monkeypatch.setattr(plots, "histories", lambda one, params: one)
    params = SimpleNamespace(scene=Scene.uniform(0.06, 0.05))
    played = {"crank-speed-pi": course(0.9), "my-policy.npz": course(0.4)}
    plots.plot_comparison(played, params, tmp_path / "both.png")
    ((figure, axes),) = sheets
    assert len(axes) == 5
    for axis, name, use in ((axes[2], "crank-speed PI", 0.9), (axes[3], "my-policy.npz", 0.4)):
        assert axis.get_title("center") == name
        (line,) = (line for line in axis.lines if len(line.get_ydata()) == 20)
        assert np.all(line.get_ydata() == use)
    assert axes[4].get_title("left") == "distance slid [mm]"
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["crank-speed PI", "my-policy.npz"]


def test_every_baseline_has_words():
    for name in (*BIPED_BASELINES, *UGV_BASELINES):
        assert "-" not in name.replace("crank-speed", "")
    assert "biped-ice" == "biped-ice"
