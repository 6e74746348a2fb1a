"""`stickslip simulate biped` from flags to files, beside `dynamics.simulate` itself."""

import csv
import re
from dataclasses import replace
from pathlib import Path
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip import flags
from stickslip.agents.pictures.episodes import draw_panels
from stickslip.cli import OK, WRONG_INPUT, main
from stickslip.commands import NOTHING_FOUND
from stickslip.dynamics import PRESETS, Scene, Status
from stickslip.dynamics.biped import BipedParams, BipedState, floor_position, prepare, simulate
from stickslip.envs.rendering.scene import paint
from stickslip.simulate import biped
from stickslip.simulate.torque import Expression
from tests.asked import prints, refusal, tells

pytestmark = pytest.mark.usefixtures("empty_directory")

WALK = ["simulate", "biped", "--crank-rate=3", "--scene=wet", "--setting=balanced"]
WALK += ["--seconds=0.3", "--period=0.01"]
LAW = "8 * (3 - crank_rate)"


def rows(path: str) -> list[dict[str, str]]:
    with Path(path).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def column(found: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in found if row[name] != ""])


def test_rows_are_those_of_the_library_digit_for_digit(capsys):
    told = tells(capsys, *WALK, f"--torque={LAW}")
    found = rows("walk.csv")
    robot = prepare(BipedParams.from_bars(), fidelity=PRESETS["balanced"].fidelity)
    start, period = BipedState(crank_rate=3.0).astype(jnp.float32), 0.3 / 30
    scene = jax.tree.map(jnp.float32, Scene.named("wet"))  # so that the command's program is used
    spec = replace(PRESETS["balanced"].integrator_over(period), record_events=True)
    path = simulate(robot, scene, start, Expression(LAW), 30 * period, period, integrator=spec)
    shown = [np.float32(row["crank rate [rad/s]"]) for row in found]
    np.testing.assert_array_equal(shown, path.states.crank_rate)
    assert [np.float32(row["torque [N m]"]) for row in found[:-1]] == path.torques.tolist()
    (summary,) = told["summary"]
    ankle = floor_position(robot, path.final)
    assert column(found, "ankle on the floor [m]")[-1] == pytest.approx(float(ankle), abs=1e-6)
    for name, of in (("slid", "slide_distance"), ("work", "work")):
        assert summary[name] == pytest.approx(float(np.sum(getattr(path.contacts, of))), abs=1e-5)
    assert summary["status"] == Status(int(path.status)).name
    assert summary["slips"] == sum(kind == "slip" for _, kind, _ in path.events())
    assert len(told["events"]) == len(path.events())
    assert told["units"]["summary"]["distance"] == "m"


def test_a_walk_fed_its_own_torques_walks_the_same(capsys):
    assert "distance" in prints(capsys, *WALK, f"--torque={LAW}")
    again = [*WALK[:-2], "--period=0.01", "--torque=walk.csv"]
    assert main([*again, "--out=again.csv"]) == OK
    first, second = rows("walk.csv"), rows("again.csv")
    for name in ("crank rate [rad/s]", "centre of mass [m]", "time [s]"):
        np.testing.assert_allclose(column(second, name), column(first, name), atol=2e-5)
    assert second[0]["status"] == ""


@pytest.mark.long
def test_a_walk_is_filmed_in_real_time_with_its_slides_to_its_end(capsys, monkeypatch):
    image = pytest.importorskip("PIL.Image")
    shown = []
    monkeypatch.setattr(
        biped, "paint", lambda picture, i: shown.append((picture, i)) or paint(picture, i)
    )
    assert main([*WALK, f"--torque={LAW}", "--film=walk.gif"]) == OK
    assert "Written: walk.csv, walk.gif" in capsys.readouterr().out
    times, walked = ([one.numbers[k][1][i] for one, i in shown] for k in (0, 1))
    assert times == pytest.approx([*np.arange(8) * 0.04, 0.3], abs=1e-6)
    every = np.asarray(column(rows("walk.csv"), "centre of mass [m]"))
    every = every - every[0]
    assert walked == pytest.approx([*every[::4][:8], every[-1]], abs=1e-7)
    with image.open("walk.gif") as film:
        assert (film.n_frames, film.info["duration"]) == (9, 40)
    assert main([*WALK, "--torque=4", "--film=fall.gif", "--overwrite"]) == NOTHING_FOUND
    assert (len(shown), shown[-1][0].ended) == (11, "topple")


@pytest.mark.parametrize("law", ["4", "5 * sin(200 * t)"])  # at once, as a period begins
def test_a_fall_ends_the_rows_and_says_so(capsys, monkeypatch, law):
    drawn = mock.Mock(wraps=biped.draw_panels)
    monkeypatch.setattr(biped, "draw_panels", drawn)
    said = prints(capsys, *WALK, f"--torque={law}", "--plot=walk.png", status=NOTHING_FOUND)
    assert re.search(r"status +TOPPLE\n", said)
    figure = draw_panels(*drawn.call_args.args)
    assert figure.get_suptitle().endswith("TOPPLE")
    assert figure.axes[0].lines[0].get_marker() == ("o" if law == "4" else "")
    found = rows("walk.csv")
    assert found[-1]["status"] == "TOPPLE"
    assert len(found) < 31
    assert np.all(np.diff(column(found, "time [s]")) > 0) == (law != "4")


def test_a_walk_in_double_precision_has_the_robot_of_double_precision(monkeypatch, float64):
    given = {}

    def noted(params, scene, *rest):
        given.update(params=params, scene=scene)
        raise ValueError("seen enough")

    monkeypatch.setattr(biped.walks, "walked", noted)
    with jax.enable_x64(False):
        assert main(["simulate", "biped", "--scene=wet", "--torque=1"]) == WRONG_INPUT
    expected = BipedParams.from_bars(), Scene.named("wet")
    for one, other in zip(
        jax.tree.leaves(tuple(given.values())), jax.tree.leaves(expected), strict=True
    ):
        np.testing.assert_array_equal(np.float64(one), np.float64(other))


def test_no_file_is_replaced_unasked(capsys):
    Path("walk.csv").write_text("mine")
    assert "walk.csv exists" in refusal(capsys, *WALK, "--torque=1")
    Path("walk.png").write_text("mine")
    assert main([*WALK, "--torque=1", "--out=w.csv", "--plot=walk.png"]) == WRONG_INPUT
    Path("walk.gif").write_text("mine")
    assert main([*WALK, "--torque=1", "--out=w.csv", "--film=walk.gif"]) == WRONG_INPUT
    assert {Path(f"walk.{kind}").read_text() for kind in ("csv", "png", "gif")} == {"mine"}
    assert not Path("w.csv").exists()


def test_names_in_the_help_are_those_of_the_library():
    assert tuple(flags.SETTINGS) == tuple(PRESETS)


@pytest.mark.long
def test_a_walk_whose_first_torque_is_no_number_is_refused_and_the_file_kept(capsys):
    Path("walk.csv").write_text("good")
    assert main([*WALK, "--torque=log(t - 1)", "--overwrite"]) == WRONG_INPUT
    assert "not finite in the first period" in capsys.readouterr().err
    assert Path("walk.csv").read_text() == "good"
    assert main([*WALK, "--torque=1 + 0 * log(0.1 - t)", "--overwrite"]) == NOTHING_FOUND
    found = rows("walk.csv")
    assert np.isfinite(column(found, "crank rate [rad/s]")).all()
    assert 8 < len(found) < 14


def test_a_rate_tells_the_friction_that_holds_it_and_what_less_slides(tmp_path, capsys):
    rows = ["crank angle [rad],crank rate [rad/s]", *(f"{k * np.pi},3" for k in (0.5, 1.0, 1.5))]
    (tmp_path / "rates.csv").write_text("\n".join(rows))
    (tmp_path / "times.csv").write_text("time [s],rate [rpm]\n0,0\n1.6,60\n")
    walk = ["simulate", "biped", "--mu-static", "0.05", "--overwrite", "--rate"]
    constant, table, rising = (
        tells(capsys, *walk, rate, "--seconds=1.5", "--out=w.csv")["summary"][0]
        for rate in ("3", "rates.csv", "times.csv")
    )
    assert constant["least_friction"] == pytest.approx(0.0799436, rel=1e-4)
    assert constant["slid_per_step"] > 1e-3
    for name in ("least_friction", "slid", "work", "needed_at"):
        assert table[name] == pytest.approx(constant[name], rel=1e-6)
    assert rising["mean_crank_rate"] == pytest.approx(np.pi * 1.5 / 1.6, rel=1e-6)
    held = tells(capsys, *walk[:3], "0.08", *walk[4:], "3", "--out=w.csv")
    assert held["summary"][0]["slid"] == 0
    (tmp_path / "rates.csv").write_text("\n".join([*rows[:-1], f"{1.5 * np.pi},4"]))
    again = refusal(capsys, *walk, "rates.csv", "--out=w.csv")
    assert "accepted: the same rate" in again
