"""The measurement of speed against accuracy: what it compares with, and what it writes."""

import json
from pathlib import Path

import jax
import numpy as np
import pytest

from benchmarks.fronts import front_of
from benchmarks.report import MARKS
from benchmarks.tradeoff import __main__ as command
from benchmarks.tradeoff import errors, measure, module, tables
from benchmarks.tradeoff.cases import Case, cases, code
from benchmarks.tradeoff.points import Point, points_of, undominated
from benchmarks.tradeoff.program import Rolled, Samples
from benchmarks.tradeoff.scenes import PERIOD, WALKS
from stickslip.dynamics.biped import Chebyshev, EventExact, RK4Split, Table, reduced_inertia
from tests.dynamics.helpers import default_params

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


def test_the_module_keeps_every_point_of_every_front(content):
    for scene in {row["scene"] for row in content["rows"]}:
        for batch in (1, 4096):
            points = points_of(content["rows"], scene, batch)
            assert set(front_of(points)) <= set(undominated(points))


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


def test_only_beaten_points_are_left_out():
    def point(cost, angle, slide, dtype="float64"):
        return Point("Reduced()", "RK4()", 0.01, dtype, angle, slide, cost)

    cheap, fine, slides = point(1, 1e-2, 1e-3), point(2, 1e-4, 1e-2), point(2, 1e-1, 1e-5)
    beaten, single = point(3, 1e-3, 1e-2), point(3, 1e-3, 1e-2, "float32")
    assert undominated([beaten, single, slides, fine, cheap]) == [cheap, slides, fine, single]


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
    for name in ("MODULE", "DOCUMENT"):
        monkeypatch.setattr(command, name, tmp_path / name)
    (tmp_path / "DOCUMENT").write_text(f"before\n{MARKS[0]}\n{MARKS[1]}\nafter\n")
    out, picture = tmp_path / "deep" / "tradeoff.json", tmp_path / "tradeoff.png"
    arguments = ["--quick", "--update", "--out", str(out), "--picture", str(picture)]
    command.main(arguments)
    content = json.loads(out.read_text(encoding="utf-8"))
    assert {"machine", "versions", "commit", "measured", "rows", "programs"} <= set(content)
    coarse, fine = content["rows"]
    assert (coarse["dt"], fine["dt"]) == (0.02, 0.005)
    assert fine["angle_error"] < 0.2 * coarse["angle_error"] < 1e-4
    assert min(row[cost] for row in content["rows"] for cost in ("cost_1", "cost_4096")) > 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert 'MEASURED_ON = "' in (tmp_path / "MODULE").read_text()
    assert "| smooth |" in (tmp_path / "DOCUMENT").read_text()
    assert "knee at table 32x7" in capsys.readouterr().out


@pytest.mark.long
def test_the_long_walk_agrees_with_a_quadrature():
    walk = WALKS["long"]
    truth = errors.reference_of(walk)
    assert truth.samples.steps[-1] >= 1000
    assert errors.long_walk_check(walk, truth) < 1e-7
