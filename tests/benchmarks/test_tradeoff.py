"""The measurement of speed against accuracy: what it compares with, and what it writes."""

import json
import re
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

from benchmarks.report import MARKS
from benchmarks.tradeoff import __main__ as command
from benchmarks.tradeoff import errors, measure, module, promises, tables
from benchmarks.tradeoff.cases import Case, cases, code, promised
from benchmarks.tradeoff.marching import references, walked
from benchmarks.tradeoff.points import cost_of, promises_of
from benchmarks.tradeoff.population import FLOORS, both, draw
from benchmarks.tradeoff.program import Rolled, Samples
from benchmarks.tradeoff.scenes import PERIOD, WALKS
from stickslip.dynamics.biped import Chebyshev, EventExact, RK4Split, Table, reduced_inertia
from tests.dynamics.biped.helpers import default_params

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def content():
    return json.loads((ROOT / command.RESULTS).read_text(encoding="utf-8"))


def samples(**columns) -> Samples:
    """A walk of the duration of "smooth": at rest at phase pi but for what is given."""
    rows = WALKS["smooth"].samples
    values = {name: np.zeros(rows) for name in Samples._fields}
    values["phase"] = np.full(rows, np.pi)
    return Samples(**(values | {name: np.full(rows, value) for name, value in columns.items()}))


def reference(**columns) -> errors.Reference:
    walk = samples(**columns)
    return errors.Reference(walk, errors.balance(walk), [], 0)


def test_measured_module_and_tables_are_those_of_the_results(content):
    assert (ROOT / command.MODULE).read_text(encoding="utf-8") == module.source(content)
    text = (ROOT / command.DOCUMENT).read_text(encoding="utf-8")
    assert tables.body(content) == text.split(MARKS[0])[1].split(MARKS[1])[0].strip()


def test_pages_that_name_the_presets_have_their_numbers(content):
    rows = [line.split("|")[1:-1] for line in tables.presets(content).splitlines()[2:]]
    page = (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for cells in rows:
        name, *rest, promised_error, cost = (cell.strip() for cell in cells)
        assert f"| {' | '.join([name, *rest, promised_error, cost])} |" in page
        for number in (promised_error, cost):
            assert re.search(rf"\b{number.replace('e-0', 'e-')}\b", readme)


def test_every_promise_has_a_cost_and_every_floor_its_promises(content):
    rows = content["population"]["rows"]
    settings = promised(quick=False)
    assert {row["integrator"] for row in rows} == {code(one.integrator) for one in settings}
    for floor in FLOORS:
        for batch in (1, 4096):
            for robots in ("default", "others"):
                own = [r for r in rows if (r["scene"], r["robots"]) == (floor, robots)]
                assert len(promises_of(content, floor, robots, batch)) == len(own) == len(settings)


def test_a_confidence_bound_is_above_the_quantile_as_often_as_it_says():
    """The k-th of n sorted values, against its coverage counted on uniform samples."""
    rng, count, tries = np.random.default_rng(7), 120, 20_000
    drawn = np.sort(rng.random((tries, count)), axis=1)
    for quantile in (0.5, 0.95):
        k = promises.rank(count, quantile, promises.CONFIDENCE)
        for place, surely in ((k, True), (k - 1, False)):
            covered = np.mean(drawn[:, place - 1] >= quantile)
            assert (covered > 0.95 - 3e-3) == surely
    assert promises.bound(np.arange(20.0), 0.95) == np.inf  # 20 walks cannot promise 95 %
    assert (
        promises.bound(np.arange(1000.0), 0.5) == promises.rank(1000, 0.5, promises.CONFIDENCE) - 1
    )


def test_a_walk_of_the_population_is_known_by_its_seed(float64):
    for floor in FLOORS:
        many, one = draw(floor, range(40, 44), "others"), draw(floor, [42], "others")
        for all_of, single in zip(jax.tree.leaves(many), jax.tree.leaves(one), strict=True):
            np.testing.assert_array_equal(np.asarray(all_of)[2:3], np.asarray(single))
        default = draw(floor, range(40, 44), "default")
        assert set(np.asarray(default.params.crank).tolist()) == {0.03}
        assert default.period == pytest.approx(0.02)


def test_the_population_covers_what_the_promise_says(float64):
    walks = both("stick-slip", range(100))
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
    edges = np.asarray(both("ice", range(50)).scene.floor.edges)
    assert np.all(np.diff(edges, axis=1) > 0)


@pytest.mark.long
def test_walks_of_scaled_robots_are_the_same_in_their_own_units():
    """Four times the length and eight times the densities and masses: own times twice as long."""
    with jax.enable_x64(True):
        walks = draw("stick-slip", range(16), "default")
        large = _scaled(walks, 4.0)
    one, two = references(walks), references(large)
    np.testing.assert_array_equal(walked(one), walked(two))
    np.testing.assert_allclose(two.angle, one.angle, rtol=0, atol=1e-7)
    np.testing.assert_allclose(two.slide, 4 * one.slide, rtol=0, atol=1e-7)


def _scaled(walks, length: float):
    """The same walks of geometrically similar robots of the same mass."""
    time = np.sqrt(length)
    robot = walks.params
    kept = {"mass", "payload", "gravity"}
    sizes = {name: value * length for name, value in vars(robot).items() if name not in kept}
    sizes["inertia"] = robot.inertia * length**2
    state = replace(
        walks.state,
        crank_rate=walks.state.crank_rate / time,
        foot_velocity=walks.state.foot_velocity * length / time,
    )
    gain, wanted, torques = walks.law
    law = (gain * length * time, wanted / time, torques * length)
    robot = replace(robot, **sizes)
    return walks._replace(params=robot, state=state, law=law, period=walks.period * time)


def test_every_axis_is_varied():
    listed = cases(quick=False)
    assert {name for case in listed for name in case.walks} == set(WALKS)
    assert {case.dtype for case in listed} == {"float32", "float64"}
    kinds = {type(case.fidelity).__name__ for case in listed}
    assert kinds == {"Joint", "Reduced", "Table", "Chebyshev", "Paper"}
    kinds = {type(case.integrator).__name__ for case in listed}
    assert kinds == {"Euler", "SemiImplicitEuler", "RK4", "RK4Split", "EventExact"}
    assert len({case.fidelity for case in listed if isinstance(case.fidelity, Table)}) >= 4
    assert len({case.integrator for case in listed if isinstance(case.integrator, EventExact)}) == 3


def test_code_makes_the_same_setting_again():
    names = {"Table": Table, "Chebyshev": Chebyshev, "RK4Split": RK4Split, "EventExact": EventExact}
    for spec in (Table(), Table(8, 4), Chebyshev(20), RK4Split(), EventExact(rtol=1e-4, atol=1e-7)):
        assert eval(code(spec), names) == spec


def test_a_walk_has_no_error_against_itself_and_its_offset_against_another():
    truth, walk = reference(), WALKS["smooth"]
    rolled = Rolled(truth.samples, np.int32(0), np.int32(0), None)
    found = errors.errors_of(walk, rolled, truth)
    assert {found[k] for k in ("angle_error", "slide_error", "energy_error", "other_mode")} == {0.0}
    off = samples(phase=np.pi + 0.2, foot_position=-0.4, normal_force=1.0, mode=1)
    found = errors.errors_of(walk, rolled._replace(samples=off), truth)
    assert found["angle_error"] == pytest.approx(0.2 / walk.duration)
    assert found["slide_error"] == pytest.approx(0.4 / walk.duration)
    assert found["normal_error"] == pytest.approx(1 / (8.466 * 9.81), rel=1e-3)
    assert found["other_mode"] == 1.0


def test_a_walk_that_leaves_the_model_has_no_error_to_show():
    truth = reference()
    left = Rolled(truth.samples, np.int32(3), np.int32(0), None)
    lost = left._replace(status=np.int32(0), samples=samples(crank_rate=1.0, phase=np.nan))
    for rolled in (left, lost):
        assert errors.errors_of(WALKS["smooth"], rolled, truth)["angle_error"] is None


def test_the_balance_counts_energy_less_work():
    still, moving = samples(), samples(crank_rate=2.0, foot_velocity=0.5, work=0.25)
    gained = errors.balance(moving) - errors.balance(still)
    with jax.enable_x64(True):
        now = reduced_inertia(default_params(), np.pi)
        M, P, mass = map(float, (now.M, now.P, default_params().total_mass))
    expected = M * 2.0**2 / 2 + P * 2.0 * 0.5 + mass * 0.5**2 / 2 - 0.25
    np.testing.assert_allclose(gained, expected, rtol=1e-12)


def test_events_are_compared_until_one_differs():
    truth = reference()._replace(events=[(0.1, 1), (0.2, 2), (0.5, 3)])
    found = errors.event_errors([(0.1, 1), (0.25, 2), (0.3, 1)], truth)
    assert found["event_error"] == pytest.approx(0.05)
    assert (found["events_alike"], found["events"], found["events_wanted"]) == (2, 3, 3)


def test_waiting_threads_and_other_work_do_not_count_as_cost():
    row = {"cost_1": 8e-4, "wall_1": 5e-4, "cost_4096": 3e-4, "wall_4096": 1e-4}
    assert (cost_of(row, 1), cost_of(row, 4096)) == (5e-4, 3e-4)
    assert cost_of(row | {"wall_1": 1e-3}, 1) == 8e-4


def test_only_what_is_missing_is_measured_again(content):
    rows = content["walks"]["rows"]
    full = cases(quick=False)
    assert all(measure.lacking(case, rows).walks == () for case in full)
    case = next(case for case in full if "ice" in case.walks and "ice" in case.batched)
    names = measure.names_of(case)
    left = [row for row in rows if row["scene"] != "ice" or not names.items() <= row.items()]
    assert measure.lacking(case, left).walks == ("ice",)
    bare = [{k: v for k, v in row.items() if k != "cost_4096"} for row in rows]
    assert set(measure.lacking(case, bare).walks) == set(case.batched) & set(case.walks)


def test_every_step_size_divides_the_control_period():
    for quick in (True, False):
        for case in cases(quick):
            for walk in case.walks:
                for count in case.counts_on(walk):
                    assert round(PERIOD / (PERIOD / count)) == count
                assert WALKS[walk].samples * WALKS[walk].stride == WALKS[walk].periods


@pytest.mark.long
def test_the_command_measures_and_writes(tmp_path, monkeypatch, capsys):
    case = Case(Table(), RK4Split(), "float32", (1, 4), ("smooth",), batch=64)
    monkeypatch.setattr(measure, "cases", lambda quick: [case])
    monkeypatch.setattr(promises, "FLOORS", ("smooth",))
    for name in ("MODULE", "DOCUMENT"):
        monkeypatch.setattr(command, name, tmp_path / name)
    (tmp_path / "DOCUMENT").write_text(f"before\n{MARKS[0]}\n{MARKS[1]}\nafter\n")
    out, picture = tmp_path / "deep" / "tradeoff.json", tmp_path / "tradeoff.png"
    command.main(["--quick", "--only", "walks", "--out", str(out)])
    coarse, fine = json.loads(out.read_text(encoding="utf-8"))["walks"]["rows"]
    assert (coarse["dt"], fine["dt"]) == (0.02, 0.005)
    assert fine["angle_error"] < 0.2 * coarse["angle_error"] < 1e-4
    assert min(row[cost] for row in (coarse, fine) for cost in ("cost_1", "cost_4096")) > 0
    arguments = ["--quick", "--update", "--out", str(out), "--picture", str(picture)]
    command.main([*arguments, "--only", "population"])
    content = json.loads(out.read_text(encoding="utf-8"))
    assert {"machine", "versions", "parts", "walks", "population"} <= set(content)
    first, *_ = content["population"]["rows"]
    assert first["bounds"]["0.5"][0] < 1e-2
    assert first["bounds"]["0.99"][0] is None  # 48 walks bound no such quantile
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert 'MEASURED_ON = "' in (tmp_path / "MODULE").read_text()
    assert "| smooth |" in (tmp_path / "DOCUMENT").read_text()


@pytest.mark.long
def test_the_long_walk_agrees_with_a_quadrature():
    walk = WALKS["long"]
    truth = errors.reference_of(walk)
    assert truth.samples.steps[-1] >= 1000
    assert errors.long_walk_check(walk, truth) < 1e-7
