"""Animations, and plots of episodes and of walks."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from stickslip.agents.biped.controllers import ConstantTorque
from stickslip.agents.biped.episodes import as_episode
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.pictures.episodes import film, plot_episode
from stickslip.envs import BipedEnv

pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

ENV = BipedEnv()


def test_a_film_has_a_picture_every_period_and_the_end(tmp_path):
    params = ENV.default_params
    path = film(ENV, ConstantTorque(0.9), params, 0, tmp_path / "walk.gif", steps=15)
    with Image.open(path) as animation:
        assert animation.n_frames == 1 + 8  # the start, every second step, the last one
    path = film(ENV, ConstantTorque(0.9), params, 0, tmp_path / "fast.png", steps=15, fps=60)
    with Image.open(path) as animation:
        assert animation.n_frames == 1 + 15  # at most one a control step


def test_an_episode_says_what_happened_and_is_plotted_without_pyplot(tmp_path):
    params = ENV.default_params
    episode = as_episode(rollout(ENV, ConstantTorque(0.9), params, 0, 15), ENV, params, "push")
    lines = {one.title: one.lines for one in episode.panels}
    np.testing.assert_allclose(lines["motor torque"][0].values[1:], 0.9, rtol=1e-6)
    momentum, cruise = (one.values for one in lines["horizontal momentum P(θ) · crank rate"])
    assert (momentum[0], momentum[-1] > 0) == (0, True)
    np.testing.assert_allclose(cruise, 1.9403, rtol=1e-4)
    assert episode.slips is not None
    assert episode.slips[1], "0.9 N m breaks the foot loose at once"
    use, mu = (one.values for one in lines["friction used"])
    np.testing.assert_allclose((use[1], mu[1]), (0.05, 0.06), rtol=1e-3)
    pyplot = "matplotlib.pyplot" in sys.modules
    path = plot_episode(episode, tmp_path / "one.png", "One")
    with Image.open(path) as picture:
        assert picture.width > 1000
        assert len(picture.convert("RGB").getcolors(2**24)) > 50
    assert ("matplotlib.pyplot" in sys.modules) == pyplot
