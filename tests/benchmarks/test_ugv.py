"""The UGV's measurement: what it compares with is right, and what it writes follows from it."""

import json
from pathlib import Path

import jax
import numpy as np
import pytest

from benchmarks.report import MARKS
from benchmarks.ugv import __main__ as command
from benchmarks.ugv import module, plain, tables, tracks
from benchmarks.ugv.errors import errors_of, truth_of
from benchmarks.ugv.growth import exponent
from benchmarks.ugv.methods import RUNS, with_gaps
from benchmarks.ugv.points import solver_name
from benchmarks.ugv.program import drawn
from benchmarks.ugv.throughput import grounds
from benchmarks.ugv.trade import cases, code
from stickslip.dynamics.ugv import PoseSolver, UGVParams

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def content():
    return json.loads((ROOT / command.RESULTS).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def ground():
    with jax.enable_x64(True):
        return grounds()


def test_measured_module_and_tables_are_those_of_the_results(content):
    assert (ROOT / command.MODULE).read_text(encoding="utf-8") == module.source(content)
    text = (ROOT / command.DOCUMENT).read_text(encoding="utf-8")
    assert tables.body(content) == text.split(MARKS[0])[1].split(MARKS[1])[0].strip()


def test_every_part_is_measured_with_its_commit_and_in_full(content):
    assert set(command.PARTS) == set(content["parts"])
    for name, part in content["parts"].items():
        assert content[name]
        assert part["commit"]
        assert not part["quick"]


def test_the_plain_vehicle_is_the_package_s():
    params = UGVParams()
    assert (params.body_length, params.leg_length) == (plain.LENGTH, plain.LEG)
    assert params.wheel_radius == plain.RADIUS
    assert float(params.weight) == pytest.approx(plain.WEIGHT, rel=1e-15)


@pytest.mark.parametrize("name", ["bump", pytest.param("rough", marks=pytest.mark.long)])
def test_what_is_compared_gives_the_same_answers(ground, name):
    track, profile = ground[name]
    truth = truth_of(track, 64)
    looped = plain.loop(profile, truth.x, truth.angles)
    at_once = plain.vectorised(profile, truth.x, truth.angles)
    for found in (looped, at_once):
        errors = errors_of(found, truth)
        assert max(errors["torque_error"], errors["force_error"]) < 1e-13
        assert errors["contact_error"] < 1e-13
        assert errors["pitch_error"] < 1e-14
        assert errors["failed"] == 0
        bodies = np.stack([found["body_x"], found["body_y"]])
        wanted = np.stack([truth.answer["body_x"], truth.answer["body_y"]])
        np.testing.assert_allclose(bodies, wanted, atol=1e-13)


def test_numpy_s_profiles_are_the_ground_s(ground):
    x = np.linspace(1.0, 7.9, 50)
    for track, profile in ground.values():
        with jax.enable_x64(True):
            wanted = track.profile(x)
        np.testing.assert_allclose(profile.array(x), wanted, rtol=1e-12, atol=1e-14)
        by_number = np.transpose([profile.scalar(float(v)) for v in x])
        np.testing.assert_allclose(by_number, wanted, rtol=1e-12, atol=1e-14)


def test_a_smaller_batch_is_the_beginning_of_a_larger_one():
    for few, many in zip(drawn("float32", 5), drawn("float64", 9), strict=True):
        np.testing.assert_array_equal(few, many[:5])


def test_every_axis_is_varied():
    listed = cases(quick=False)
    assert {case.track for case in listed} == {"bump", "rough", "sines"}
    assert {case.dtype for case in listed} == {"float32", "float64"}
    kinds = {"exact", "quintic", "cubic", "pchip", "makima", "linear"}
    assert {case.interpolation for case in listed} == kinds
    solvers = {case.solver for case in listed}
    assert len({s.iterations for s in solvers}) >= 4
    assert len({s.tolerance for s in solvers}) >= 3
    assert {s.samples > 0 for s in solvers} == {True, False}
    for solver in solvers:
        assert eval(code(solver), {"PoseSolver": PoseSolver}) == solver


def test_twelve_tracks_are_twelve_and_of_one_structure():
    listed = tracks.twelve()
    assert len({one.name for one in listed}) == 12
    with jax.enable_x64(True):
        built = [one.track() for one in listed]
    kinds = {jax.tree.structure(t.shape) for t in built}
    assert len(kinds) == 1
    assert len({np.asarray(t.shape.coefficients).tobytes() for t in built}) == 12


def test_gaps_are_counted_from_the_best_feasible_value():
    def row(method, value, feasible=True, bound=None):
        return {
            "method": method,
            "value": value,
            "feasible": feasible,
            "bound": bound,
            "straight": 10.0,
        }

    rows = [row("grid", 1.0, feasible=False), row("dp", 4.0, bound=4.0), row("scp", 3.0)]
    grid, dp, scp = with_gaps(rows)
    assert (grid["gap"], dp["gap"], scp["gap"]) == (None, 0.1, 0.0)
    assert (dp["over_dp"], scp["over_dp"]) == (0.0, -0.1)
    assert all(one["gap"] is None for one in with_gaps([row("scp", 1.0, feasible=False)]))


def test_every_method_was_run_on_every_track(content):
    rows = [(r["criterion"], r["track"], r["method"]) for r in content["methods"]]
    assert len(rows) == len(set(rows)) == 2 * 12 * len(RUNS)
    assert {row[2] for row in rows} == set(RUNS)
    for row in content["methods"]:
        if row["gap"] is not None:
            assert row["gap"] >= 0
            assert row["finer"] is not None
        if row["method"] == "dp" and row["feasible"]:
            assert abs(row["over_dp"]) < 1e-9


def test_an_exponent_is_the_slope_of_the_upper_half():
    sizes = [1.0, 2.0, 4.0, 8.0]
    assert exponent(sizes, [9.0, 9.0, 16.0, 64.0]) == pytest.approx(2.0)


def test_solvers_are_named_by_what_they_do():
    assert solver_name("PoseSolver()") == "adaptive"
    assert solver_name("PoseSolver(iterations=3)") == "3 iterations"
    assert solver_name("PoseSolver(tolerance=0.01, samples=0)") == "tolerance 1e-02, unchecked"


@pytest.mark.long
def test_the_command_measures_writes_and_keeps_the_other_parts(tmp_path, monkeypatch, capsys):
    for name in ("MODULE", "DOCUMENT", "PICTURE"):
        monkeypatch.setattr(command, name, tmp_path / f"{name}.png")
    (tmp_path / "DOCUMENT.png").write_text(f"before\n{MARKS[0]}\n{MARKS[1]}\nafter\n")
    out = tmp_path / "deep" / "ugv.json"
    command.main(["--quick", "--only", "dp", "--out", str(out)])
    command.main(["--quick", "--update", "--only", "trade", "--out", str(out)])
    content = json.loads(out.read_text(encoding="utf-8"))
    assert set(content["parts"]) == {"growth", "grids", "trade"}
    assert all(part["quick"] for part in content["parts"].values())
    assert all(row["excess"] > -1e-6 for row in content["grids"])
    assert min(row["cost"] for row in content["trade"]) > 0
    assert 'MEASURED_ON = "' in (tmp_path / "MODULE.png").read_text()
    assert "### Dynamic programming: time" in (tmp_path / "DOCUMENT.png").read_text()
    assert (tmp_path / "PICTURE.png").read_bytes().startswith(b"\x89PNG")
    assert "Written:" in capsys.readouterr().out
