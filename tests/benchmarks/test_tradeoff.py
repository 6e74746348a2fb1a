"""The measurement of speed against accuracy: what it compares with, and what it writes."""

import json
import re
from functools import partial

import numpy as np
import pytest

from benchmarks.report import MARKS, RESULTS, measured_by_command, upper_bound
from benchmarks.tradeoff import __main__ as command
from benchmarks.tradeoff import walks as population
from benchmarks.tradeoff.__main__ import cost_of
from tests.documents import ROOT


@pytest.fixture(scope="module")
def content():
    return json.loads((ROOT / RESULTS / "tradeoff.json").read_text(encoding="utf-8"))


def test_measured_module_and_tables_are_those_of_the_results(content):
    assert (ROOT / command.DATA).read_text(encoding="utf-8") == command.source(content)
    text = (ROOT / command.DOCUMENT).read_text(encoding="utf-8")
    assert command.body(content) == text.split(MARKS[0])[1].split(MARKS[1])[0].strip()


def test_pages_that_name_the_presets_have_their_numbers(content):
    rows = [line.split("|")[1:-1] for line in command.presets(content).splitlines()[2:]]
    page = re.sub(" +", " ", (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8"))
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for cells in rows:
        name, *rest, promised_error, cost = (cell.strip() for cell in cells)
        assert f"| {' | '.join([name, *rest, promised_error, cost])} |" in page
        for number in (promised_error, cost):
            assert re.search(rf"\b{number.replace('e-0', 'e-')}\b", readme)


def test_a_confidence_bound_is_above_the_quantile_as_often_as_it_says():
    """The k-th of n sorted values, against its coverage counted on uniform samples."""
    rng, count, tries = np.random.default_rng(7), 120, 20_000
    drawn = np.sort(rng.random((tries, count)), axis=1)
    for quantile in (0.5, 0.95):
        k = int(upper_bound(np.arange(count)[::-1], quantile, 0.95))
        for place, surely in ((k, True), (k - 1, False)):
            assert (np.mean(drawn[:, place] >= quantile) > 0.95 - 3e-3) == surely
    assert upper_bound(np.arange(20.0), 0.95, 0.95) == np.inf  # 20 walks cannot promise 95 %


def test_errors_count_while_the_reference_is_inside_and_an_early_end_is_infinitely_wrong():
    true = population.Path(np.zeros((4, 3)), np.zeros((4, 3)), np.array([[0, 1, 3]] * 4))
    angle = np.array([[0.1, 0.2, 9.0], [0.1, 0.2, 9.0], [0.1, np.nan, 0.0], [0.0, 0.0, 9.0]])
    own = population.Path(angle, -angle, np.array([[0, 0, 0], [0, 3, 3], [0, 1, 1], [0, 0, 0]]))
    turned, slid = population.walk_errors(own, true)
    np.testing.assert_array_equal(turned, [0.2, np.inf, np.inf, 0.0])
    np.testing.assert_array_equal(slid, turned)


def test_the_population_covers_what_the_promise_says(float64):
    walks = population.both("stick-slip", range(100))
    crank, mu = np.asarray(walks.params.crank), np.asarray(walks.scene.floor.mu_static)
    assert len(crank) == 200
    assert 0.01 <= crank.min() < 0.013
    assert 0.25 < crank.max() <= 0.3
    assert 0.02 <= mu.min() < 0.025
    assert 0.4 < mu.max() <= 0.5
    ratio = np.asarray(walks.scene.floor.mu_kinetic) / mu
    assert 0.6 <= ratio.min() < ratio.max() <= 1.0
    torques = np.asarray(walks.law[2])
    assert {len(set(row)) == 1 for row in torques} == {True, False}
    edges = np.asarray(population.both("ice", range(50)).scene.floor.edges)
    assert np.all(np.diff(edges, axis=1) > 0)


def test_waiting_threads_and_other_work_do_not_count_as_cost():
    row = {"cost_1": 8e-4, "wall_1": 5e-4, "cost_4096": 3e-4}
    assert (cost_of(row, 1), cost_of(row, 4096)) == (5e-4, 3e-4)
    assert cost_of(row | {"wall_1": 1e-3}, 1) == 8e-4


@pytest.mark.long
def test_the_command_measures_and_writes(tmp_path, monkeypatch):
    monkeypatch.setattr(population, "FLOORS", ("smooth",))
    for name in ("DATA", "DOCUMENT", "PICTURE"):
        monkeypatch.setattr(command, name, tmp_path / f"{name}.png")
    (tmp_path / "DOCUMENT.png").write_text(f"before\n{MARKS[0]}\n{MARKS[1]}\nafter\n")
    out = tmp_path / "deep" / "tradeoff.json"
    run = partial(measured_by_command, "tradeoff", None, command.PARTS, command.update)
    run(["--quick", "--only", "costs", "--out", str(out)])
    coarse, fine = json.loads(out.read_text(encoding="utf-8"))["costs"]
    assert (coarse["dt"], fine["dt"]) == (0.02, 0.005)
    assert min(row[cost] for row in (coarse, fine) for cost in ("cost_1", "cost_4096")) > 0
    run(["--quick", "--update", "--only", "samples", "population", "--out", str(out)])
    content = json.loads(out.read_text(encoding="utf-8"))
    assert {"samples", "population", "costs"} == set(content["parts"])
    first, *_ = content["population"]
    assert first["bounds"]["0.5"][0] < 1e-2
    assert first["bounds"]["0.99"][0] is None  # 48 walks bound no such quantile
    assert (tmp_path / "PICTURE.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "DATA.png").read_text())["costs_measured_on"]
    assert "Not measured." in (tmp_path / "DOCUMENT.png").read_text()
