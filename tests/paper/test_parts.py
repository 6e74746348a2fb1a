"""The parts of the figures: peaks, slides, names, tables."""

import re

import numpy as np
import pytest

from stickslip.cli import OK, WRONG_INPUT, main
from stickslip.optim.gait.footing import peak_of
from stickslip.paper.figure import FIGURES, figures_of
from stickslip.paper.slip import Slide, Walk


def test_a_peak_between_samples_is_found_to_third_order():
    errors = []
    for count in (40, 80):
        x = np.linspace(0, 1, count + 1)
        place, value = peak_of(np.cos(x - 0.333) + 0.1 * (x - 0.333) ** 3)
        assert value == pytest.approx(1, abs=1e-6)
        errors.append(abs(place - 0.333))
    assert errors[1] < errors[0] / 3.5
    assert peak_of(np.array([3.0, 2.0, 1.0])) == (0.0, 3.0)


def test_a_slide_over_the_exchange_counts_in_each_step_with_its_share():
    time = np.linspace(0, 3, 31)
    # -2 mm in the first step; +6 mm from 1.4 T to 2.2 T, 3/4 of it in the second step
    place = -2e-3 * np.clip(time / 0.5, 0, 1) + 6e-3 * np.clip((time - 1.4) / 0.8, 0, 1)
    one = Walk(1.0, time, place, (Slide(0.0, 0.5, -2e-3), Slide(1.4, 2.2, 6e-3)))
    parts = [one.within(step) for step in range(3)]
    assert [[(p.start, p.end) for p in of] for of in parts] == [
        [(0.0, 0.5)],
        [(1.4, 2.0)],
        [(2.0, 2.2)],
    ]
    moved = [p.displacement for of in parts for p in of]
    assert moved == pytest.approx([-2e-3, 4.5e-3, 1.5e-3])
    assert [one.distance(step) for step in range(3)] == pytest.approx([2e-3, 4.5e-3, 1.5e-3])
    assert sum(moved) == pytest.approx(one.displacement)
    assert one.starting_in(1) == one.slides[1:]
    assert one.starting_in(2) == ()


def test_names_come_in_the_chapters_order_and_all_means_all():
    assert list(figures_of(["fig19", "fig11", "fig19"])) == ["fig11", "fig19"]
    assert list(figures_of(["all"])) == list(figures_of(["fig12", "all"])) == list(FIGURES)
    with pytest.raises(ValueError, match=r"'fig1'.*accepted: fig11, .*fig25, all"):
        figures_of(["fig1"])


def test_a_figure_of_another_robot_has_no_statement_of_the_chapter(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    command = ["reproduce", "fig11", "--samples", "24", "--out", str(tmp_path)]
    assert main([*command, "--set", "robot.crank_length=60 mm"]) == OK
    assert "the chapter" not in (tmp_path / "fig11.md").read_text()
    head = (tmp_path / "fig11.csv").read_text().partition("\n")[0]
    assert [float(one) for one in re.findall(r"([\d.]+) rad/s", head)] == pytest.approx(
        [0, *(w / np.sqrt(2) for w in range(1, 6))], rel=4e-3
    )  # a robot twice as long walks alike at rates smaller by the square root of two
    assert main([*command, "--overwrite", "--set", "vehicle.leg_mass=10"]) == WRONG_INPUT
    assert "accepted: the ugv's" in capsys.readouterr().err
