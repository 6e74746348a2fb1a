"""`stickslip view --html`: what is on the page is what the episode was."""

import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.evaluation.rollout import rollout, without_resets
from stickslip.agents.registry import machine_by_name
from stickslip.agents.reports.course import total
from stickslip.cli import OK, WRONG_INPUT, main
from stickslip.envs import BipedEnv
from stickslip.envs.rendering.html.data import Shown
from tests.pages import read_episodes


@pytest.fixture(autouse=True)
def _in_an_empty_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)


def line(shown: Shown, title: str, index: int = 0) -> np.ndarray:
    return next(one for one in shown.panels if one.title == title).lines[index].values


def test_two_baselines_on_one_page(capsys: pytest.CaptureFixture[str]):
    names = ["constant-torque", "crank-speed-pi"]
    assert main(["view", *names, "--html", "a.html", "--seconds", "0.4"]) == OK
    one, two = read_episodes("a.html")
    shown = ["constant torque", "crank-speed PI"]
    assert [one.name, two.name] == shown
    assert not np.array_equal(line(one, "motor torque"), line(two, "motor torque"))
    capsys.readouterr()
    assert main(["view", *names, "--html", "a.html"]) == WRONG_INPUT
    assert "a.html exists" in capsys.readouterr().err


def test_the_page_of_a_walk_holds_its_numbers():
    machine, env = machine_by_name("biped"), without_resets(BipedEnv())
    params = env.default_params.replace(time_limit=0.6)
    played = rollout(env, machine.baseline("constant-torque", env), params, 0).trimmed()
    shown = machine.shown(played, env, params, "walker")
    assert shown.samples == len(played.reward) + 1
    np.testing.assert_allclose(line(shown, "motor torque")[1:], played.info["torque"])
    terms = next(one for one in shown.panels if one.title == "reward of each step")
    parts = np.sum([one.values[1:] for one in terms.lines if not one.dashed], axis=0)
    np.testing.assert_allclose(parts, played.reward, atol=1e-6)
    assert line(shown, "return so far")[-1] == pytest.approx(played.reward.sum(), rel=1e-5)
    np.testing.assert_allclose(line(shown, "return so far"), total(played.reward))
    slid = shown.slips
    assert slid is not None
    np.testing.assert_array_equal(slid[1:], (played.info["slid"] > 1e-7) | (played.state.mode != 0))
    assert shown.drawing is not None
    place = shown.drawing.points[-1, :, 0]
    assert place.min() < float(played.info["episode_walked"][-1]) + 0.5 < place.max() + 1.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("view computed-torque crank-speed-pi", "several with --html"),
        ("view computed-torque --html a.gif", "ends in '.gif'; accepted: .html"),
        ("view computed-torque --html a.html --out b.gif", "--html with --out"),
        ("view computed-torque --html a.html --seconds nan", "seconds = nan"),
        (f"view {'computed-torque ' * 9}--html a.html", "9 to show"),
    ],
)
def test_wrong_input_is_a_line(arguments: str, said: str, capsys: pytest.CaptureFixture[str]):
    assert main(arguments.split()) == WRONG_INPUT
    message = capsys.readouterr().err
    assert said in message
    assert re.fullmatch(r"stickslip: error: [^\n]+\n", message)
