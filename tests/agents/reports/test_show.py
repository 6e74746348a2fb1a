"""What people hold shows itself in a notebook."""

import html
import re
from pathlib import Path

import jax
import numpy as np
import pytest

from stickslip.agents import ConstantTorque, CrankSpeedPI, evaluate, rollout, show
from stickslip.agents.reports.show import TALL
from stickslip.envs import BipedEnv
from stickslip.optim.result import OptimStatus, Result
from tests.pages import read_episodes


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
    assert repr(view) == "View('a <b>, steady on BipedEnv', episodes=2)"
    path = view.save(tmp_path / "page.html")
    assert path.read_text(encoding="utf-8") == html.unescape(source)
    assert [one.name for one in read_episodes(path)] == ["a <b>", "steady"]
    with pytest.raises(ValueError, match=r"page.html exists"):
        view.save(path)
    with pytest.raises(ValueError, match="players is empty"):
        show(env, {}, params)


def test_tables_and_rollouts_show_themselves():
    env = BipedEnv()
    params = env.default_params.replace(time_limit=0.2)
    table = evaluate(env, {"<i>pull": ConstantTorque()}, {"here": params}, episodes=1)
    text = table._repr_html_()
    assert "&lt;i&gt;pull" in text
    assert "<i>" not in text
    played = rollout(env, ConstantTorque(), params, 0)
    assert f"{float(np.sum(played.trimmed().reward)):.6g}" in played._repr_html_()
    batch = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), played)
    assert "a batch (2,)" in batch._repr_html_()


def test_a_result_says_what_is_proved_of_it():
    found = Result(
        "dp", OptimStatus.FEASIBLE, np.zeros(2), 3.5, 2.25, True, message="over <angles>"
    )
    text = found._repr_html_()
    assert "3.5" in text
    assert "2.25" in text
    assert "over &lt;angles&gt;" in text
    assert "meets every constraint" in text
    none = Result("dp", OptimStatus.FAILED, None, np.inf, message="no way")
    assert "no point" in none._repr_html_()
    assert "no way" in none._repr_html_()
