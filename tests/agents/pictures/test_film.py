"""Animations and plots of an episode."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from stickslip.agents.biped.controllers import ConstantTorque
from stickslip.agents.biped.pictures.histories import histories
from stickslip.agents.biped.pictures.plots import plot_comparison, plot_episode
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.pictures.film import film
from stickslip.envs import BipedEnv

pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

ENV = BipedEnv()


@pytest.fixture(scope="module")
def params():
    return ENV.default_params


def test_a_film_has_a_picture_every_period_and_the_end(params, tmp_path):
    path = film(ENV, ConstantTorque(0.9), params, 0, tmp_path / "walk.gif", steps=15)
    with Image.open(path) as animation:
        assert animation.n_frames == 1 + 8  # the start, every second step, the last one
    with pytest.raises(ValueError, match="fps = 60"):
        film(ENV, ConstantTorque(0.9), params, 0, tmp_path / "walk.png", steps=15, fps=60)


def test_plots_are_written_without_a_display_or_pyplot(params, tmp_path):
    played = rollout(ENV, ConstantTorque(0.9), params, 0, 15)
    pyplot = "matplotlib.pyplot" in sys.modules
    paths = [
        plot_episode(played, params, tmp_path / "one.png"),
        plot_comparison({"a": played, "b": played}, params, tmp_path / "two.png"),
    ]
    for path in paths:
        with Image.open(path) as picture:
            assert picture.width > 1000
            assert len(picture.convert("RGB").getcolors(2**24)) > 50
    assert ("matplotlib.pyplot" in sys.modules) == pyplot
    with pytest.raises(ValueError, match="played is empty"):
        plot_comparison({}, params, tmp_path / "none.png")


def test_histories_say_what_happened(params):
    course = histories(rollout(ENV, ConstantTorque(0.9), params, 0, 15), params)
    np.testing.assert_allclose(course.time, 0.02 * np.arange(1, 16), rtol=1e-6)
    np.testing.assert_allclose(course.torque, 0.9, rtol=1e-6)
    np.testing.assert_allclose(course.cruise, 1.9403, rtol=1e-4)
    assert course.sliding[0], "0.9 N m breaks the foot loose at once"
    np.testing.assert_allclose(course.friction_use[0], 0.05 / 0.06, rtol=1e-3)
