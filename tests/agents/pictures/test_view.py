"""Pages of `stickslip view` and notebooks: what is on the page is what the episode was."""

import html
import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import ConstantTorque, CrankSpeedPI, rollout, show
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.machine import machine_by_name
from stickslip.agents.pictures import view
from stickslip.agents.pictures.view import TALL
from stickslip.cli import OK, main
from stickslip.envs import BipedEnv
from stickslip.envs.rendering.page import Episode
from tests.asked import refusal
from tests.pages import read_episodes

pytestmark = pytest.mark.usefixtures("empty_directory")


def line(shown: Episode, title: str, index: int = 0) -> np.ndarray:
    return next(one for one in shown.panels if one.title == title).lines[index].values


def test_two_baselines_on_one_page(capsys: pytest.CaptureFixture[str]):
    names = ["constant-torque", "crank-speed-pi"]
    assert main(["view", *names, "--out", "a.html", "--seconds", "0.4"]) == OK
    one, two = read_episodes("a.html")
    assert [one.name, two.name] == ["constant-torque", "crank-speed-pi"]
    assert not np.array_equal(line(one, "motor torque"), line(two, "motor torque"))
    assert "a.html exists" in refusal(capsys, "view", *names, "--out", "a.html")


def test_the_page_of_a_walk_holds_its_numbers():
    machine, env = machine_by_name("biped"), without_resets(BipedEnv())
    params = env.default_params.replace(time_limit=0.6)
    played = rollout(env, machine.baseline("constant-torque", env), params, 0).trimmed()
    shown = machine.as_episode(played, env, params, "walker")
    assert shown.samples == len(played.reward) + 1
    np.testing.assert_allclose(line(shown, "motor torque")[1:], played.info["torque"])
    terms = next(one for one in shown.panels if one.title == "reward of each step")
    parts = np.sum([one.values[1:] for one in terms.lines if not one.dashed], axis=0)
    np.testing.assert_allclose(parts, played.reward, atol=1e-6)
    assert line(shown, "return so far")[-1] == pytest.approx(played.reward.sum(), rel=1e-5)
    np.testing.assert_allclose(
        line(shown, "return so far"), np.append(0.0, np.cumsum(played.reward, dtype=float))
    )
    slid = shown.slips
    assert slid is not None
    np.testing.assert_array_equal(slid[1:], (played.info["slid"] > 1e-7) | (played.state.mode != 0))
    assert shown.drawing is not None
    place = shown.drawing.points[-1, :, 0]
    assert place.min() < float(played.info["episode_walked"][-1]) + 0.5 < place.max() + 1.0


def test_without_pillow_a_page_is_written(monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setattr(view, "find_spec", lambda _: None)
    assert main(["view", "constant-torque", "--seconds", "0.1"]) == OK
    assert "Written: constant-torque-slippery.html" in capsys.readouterr().out
    assert len(read_episodes("constant-torque-slippery.html")) == 1


@pytest.mark.long
def test_players_are_shown_in_a_frame_that_reaches_nothing(tmp_path: Path):
    env = BipedEnv()
    params = env.default_params.replace(time_limit=0.2)
    view = show(env, {"a <b>": ConstantTorque(), "steady": CrankSpeedPI()}, params)
    text = view._repr_html_()
    (source,) = re.findall(r'srcdoc="([^"]*)"', text)
    assert "<b>" not in text
    assert 'sandbox="allow-scripts"' in text
    assert f"height:{TALL}px" in text
    assert repr(view) == "View()"  # a notebook keeps it beside the page itself
    path = view.save(tmp_path / "page.html")
    assert path.read_text(encoding="utf-8") == html.unescape(source)
    assert [one.name for one in read_episodes(path)] == ["a <b>", "steady"]
    with pytest.raises(ValueError, match=r"page.html exists"):
        view.save(path)
    with pytest.raises(ValueError, match="players = 0; accepted: 1 to"):
        show(env, {}, params)
