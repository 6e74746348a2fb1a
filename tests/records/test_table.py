"""Tables and JSON as text, letter by letter."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.report import markdown
from stickslip.agents.evaluation.table import Column as Metric
from stickslip.agents.evaluation.table import Evaluation, Interval, Row
from stickslip.records.table import Table, cell_text, csv_line, json_text


class Played:
    """Two episodes."""

    reward = (1.0, 2.0)


@pytest.fixture
def evaluation() -> Evaluation:
    speed, falls = Metric("speed", "m/s", 3), Metric("falls", "%", 0, percent=True)
    columns = {"speed": (speed, None), "falls": (falls, None)}
    shares = Interval(0.25, 0.125, 0.5), Interval(math.nan)
    speeds = Interval(-1.25, -1.5, -1.0), Interval(2.0), Interval(math.nan)
    given = [("grip", "pi", speeds[0], shares[0]), ("grip", "a | b", speeds[1], shares[1])]
    given.append(("ice", "pi", speeds[2], shares[1]))
    rows = tuple(
        Row(scene, who, {"speed": one, "falls": other}, Played())
        for scene, who, one, other in given
    )
    return Evaluation(rows, (0, 1), columns)


def test_an_evaluation_is_a_table_in_markdown_for_a_terminal_and_in_csv(evaluation, tmp_path):
    assert evaluation.shown().markdown() == (
        "| scene | controller | episodes | speed [m/s] | falls [%] |\n"
        "| --- | --- | ---: | ---: | ---: |\n"
        "| grip | pi | 2 | −1.250 ± 0.250 | 25 (12 to 50) |\n"
        "| grip | a &#124; b | 2 | 2.000 | - |\n"
        "| ice | pi | 2 | - | - |\n"
    )
    assert evaluation.to_text() == (
        "scene  controller  episodes     speed [m/s]      falls [%]\n"
        "─────  ──────────  ────────  ──────────────  ─────────────\n"
        "grip   pi                 2  −1.250 ± 0.250  25 (12 to 50)\n"
        "       a | b              2           2.000              -\n"
        "\n"
        "ice    pi                 2               -              -\n"
    )
    named = replace(evaluation, rows=(replace(evaluation.rows[0], scene="<b> & c"),))._repr_html_()
    assert named.startswith("<pre>scene")
    assert "&lt;b&gt; &amp; c" in named  # whatever the name, text
    noted = replace(evaluation, seeds=(0, 1, 2, 3)).to_text()
    assert noted.endswith(
        "\nNothing is drawn in grip, ice: all 4 episodes are the same one, which was played once.\n"
    )
    assert evaluation.write_csv(tmp_path / "table.csv").read_text(encoding="utf-8") == (
        "scene,controller,episodes,speed,speed_low,speed_high,falls,falls_low,falls_high\n"
        "grip,pi,2,-1.25,-1.5,-1.0,0.25,0.125,0.5\n"
        "grip,a | b,2,2.0,,,,,\n"
        "ice,pi,2,,,,,,\n"
    )


def test_a_benchmarks_table_is_aligned_with_what_begins_with_a_digit_to_the_right():
    rows = [{"case": "grip", "error": "1e-3", "flops": 12}, {"case": "μ", "error": "-", "flops": 9}]
    assert markdown(rows) == (
        "| case | error | flops |\n"
        "| ---- | ----- | ----: |\n"
        "| grip | 1e-3  |    12 |\n"
        "| μ    | -     |     9 |"
    )


def test_columns_are_csv_with_ten_digits():
    columns = {"a [m]": np.asarray([1 / 3, np.nan, np.inf], "f8"), "b": ["x, y", 'a "b"', 7]}
    assert (
        Table.of_columns(columns).csv(digits=10)
        == 'a [m],b\n0.3333333333,"x, y"\n,"a ""b"""\ninf,7\n'
    )
    assert csv_line([1, "", "é"]) == "1,,é\n"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (None, None, ""),
        (math.nan, 3, ""),
        (1 / 3, None, "0.3333333333333333"),
        (np.float32(0.1), None, "0.1"),
        (np.float32(0.1), 10, "0.1000000015"),
        (np.int64(-4), 3, "-4"),
        (123456, 3, "123456"),
        ("1/3", 3, "1/3"),
    ],
)
def test_a_cell_is_as_it_is_or_has_the_digits_asked_for(value, digits, text):
    assert cell_text(value, digits) == text


def test_json_has_null_for_what_is_not_finite_and_keeps_every_letter():
    content = {"μ": [math.nan, np.float32(0.5)], "of": {1: np.arange(2)}, "none": None}
    expected = {"μ": [None, 0.5], "of": {"1": [0, 1]}, "none": None}
    assert json_text(content) == json.dumps(expected, indent=1, ensure_ascii=False) + "\n"
