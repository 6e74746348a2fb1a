"""Friction, load and the encoder's errors from logs that an exact simulation made."""

import json
from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.cli import main
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from stickslip.dynamics.biped.estimation import Belief
from stickslip.optim import identification
from stickslip.optim.identification import WalkLog, identify


def log_of(mu_static, mu_kinetic, payload, seconds, rate=2.6, noise=4e-4, delay=0.0, bias=0.0):
    """Log of a walk at a varying rate, simulated without tables and with exact switches."""
    law = lambda state: 3 * (rate + 0.4 * jnp.sin(1.3 * state.time) - state.crank_rate)  # noqa: E731
    with jax.enable_x64(True):
        walk = simulate(
            BipedParams.from_bars(payload=payload),
            Scene.uniform(mu_static, mu_kinetic),
            BipedState(crank_rate=rate),
            law,
            seconds,
            0.005,
            integrator="event_exact",
        )
        times, angles = np.asarray(walk.states.time), np.asarray(walk.states.crank_angle)
    read = np.interp(times - delay, times, angles) + bias
    read[times < delay] += rate * (times[times < delay] - delay)
    read += noise * np.random.default_rng(1).standard_normal(len(read))
    return WalkLog(times, np.append(walk.torques, 0.0), read), walk


@pytest.fixture
def quick(monkeypatch):
    """A search of few frictions."""
    few = {"MEMBERS": 16, "LAST": 16, "BEST": 4, "GRID": (16, 3), "ROUNDS": 2, "FIRST": (1,)}
    for name, value in (few | {"DISTURBANCES": 0.25 * 0.25 ** np.arange(5)}).items():
        monkeypatch.setattr(identification, name, value)


def identified(path, capsys, log):
    """What the command finds of a log, and its parameters by name."""
    pytest.importorskip("matplotlib", reason="needs the extra viz")
    rows = np.stack([log.times, log.torques, log.angles], -1)
    np.savetxt(path, rows, delimiter=",", header="t,torque,theta", comments="")
    assert main(["identify", str(path), "--json"]) == 0
    assert path.with_suffix(".png").stat().st_size > 10_000
    told = json.loads(capsys.readouterr().out)
    return told, {row["parameter"]: row for row in told["parameters"]}


@pytest.mark.parametrize("uneven", [0.0, 0.3])
def test_neither_wrong_angles_nor_uneven_rows_count_as_noise(uneven):
    random = np.random.default_rng(0)
    times = (np.arange(900) + uneven * random.uniform(-0.5, 0.5, 900)) / 100
    angles = 2.6 * times + 0.3 * np.sin(5.2 * times) + 2e-4 * random.standard_normal(900)
    angles[[100, 500]] += 2.0, 0.1
    assert WalkLog(times, 0 * times, angles).noise == pytest.approx(2e-4, rel=0.15)


@pytest.mark.parametrize("rows", [20, 61, 200, 600])
def test_mere_noise_is_seldom_more_than_a_log_of_any_length_shows(rows, float64):
    log = WalkLog(times := 0.02 * np.arange(rows), times, times)
    errors = 1e-3 * np.random.default_rng(0).standard_normal((1000, rows))
    most = identification._Search(BipedParams.from_bars(), log, (), None, 0).most
    found = [np.mean(one**2) / WalkLog(times, times, one).noise ** 2 for one in errors]
    assert np.mean(np.array(found) > most) < 0.015


@pytest.mark.long
@pytest.mark.parametrize("wrong", [0.0, 0.02])
def test_a_short_log_is_explained_where_the_model_is_right(quick, wrong):
    log, _ = log_of(0.5, 0.4, 0.3, 0.3, noise=1e-3)
    log = WalkLog(log.times, log.torques, log.angles + wrong * np.sin(60 * log.times))
    assert identify(BipedParams.from_bars(), log).explained == (wrong == 0)


def test_the_first_rows_of_a_start_tell_where_it_begins_and_how_well():
    times = 0.01 * np.arange(30)
    angles = 1.5 + 3.0 * times + 45 * times**2 + 100 * times**3  # 14 rad/s in the tenth row
    with jax.enable_x64(True):
        log = WalkLog(times, 0 * times, angles)
        angle, rate, known = identification._Search(BipedParams.from_bars(), log, (), 1e-4, 0).began
    assert abs(angle - 1.5) < known[0] < 0.1
    assert abs(rate - 3.0) < known[1] < 2.0


def test_a_gap_changes_neither_the_noise_nor_the_filters_rows():
    times = 0.005 * np.arange(200)
    angles = 2.0 + 3 * times + 1e-3 * np.random.default_rng(0).standard_normal(200)
    kept = np.delete(np.arange(200), np.arange(90, 120))
    log = WalkLog(times[kept], np.full(170, 0.1), angles[kept])
    assert log.noise == pytest.approx(1e-3, rel=0.2)
    with jax.enable_x64(True):
        search = identification._Search(BipedParams.from_bars(), log, (), 1e-3, 0)
    begin, end, _, duration, read = search.log[1]
    assert len(begin) == len(times) - 1
    np.testing.assert_allclose(np.append(begin, end[-1]), times, atol=1e-12)
    np.testing.assert_allclose(duration, 0.005)
    np.testing.assert_array_equal(read[search.rows], log.angles[1:])
    assert np.isnan(read).sum() == 30
    assert search.static[1].substeps == 1


def test_an_interval_is_that_of_the_likelihood_however_narrow_the_search_was():
    search, middle = object.__new__(identification._Search), np.log([0.06, 0.04])
    search.random, spread = np.random.default_rng(0), 1e-3 * np.array([[9.0, 2.0], [2.0, 0.6]])

    def tried(points, *_):
        off, nothing = points - middle, np.zeros((len(points), 8))
        misfit = np.sum(off @ np.linalg.inv(spread) * off, axis=1)
        found = Belief(nothing, nothing, misfit, misfit, misfit)
        return identification._Tried(points, found).take(np.argsort(misfit))

    search.tried, search.bar = tried, identification.Bar("", None, "", False)
    near, even = search.region(middle, 1e-4 * spread, 0.1)
    sides = np.sqrt(identification.JOINT * np.diagonal(spread))
    np.testing.assert_allclose(np.ptp(near.points, axis=0) / 2, sides, rtol=0.1)
    weights = np.exp(-even.last.misfit / 2)
    np.testing.assert_allclose(weights @ even.points / sum(weights), middle, atol=0.02)


@pytest.mark.long
def test_a_log_with_slips_tells_friction_and_payload(quick, tmp_path, capsys):
    log, walk = log_of(0.05, 0.04, 0.3, 1.0)
    assert np.sum(np.asarray(walk.states.foot_velocity) != 0) > 10
    told, found = identified(tmp_path / "log.csv", capsys, log)
    for name, true in (("mu_static", 0.05), ("mu_kinetic", 0.04), ("payload", 0.3)):
        assert found[name]["low"] <= true <= found[name]["high"]
    assert abs(found["mu_kinetic"]["value"] / 0.04 - 1) < 0.02
    assert found["payload"]["high"] - found["payload"]["low"] < 0.2
    assert told["slipped"]
    assert told["explained"]


@pytest.mark.long
def test_a_log_without_slip_tells_a_bound_on_friction(quick, tmp_path, capsys):
    log, walk = log_of(0.5, 0.4, 0.3, 1.0)
    needed = np.max(np.abs(walk.contacts.friction_force / walk.contacts.normal_force))
    told, found = identified(tmp_path / "log.csv", capsys, log)
    assert not told["slipped"]
    assert 0.8 * needed < found["mu_static"]["low"] < 1.02 * needed
    assert [found["mu_static"]["high"], found["mu_kinetic"]["value"]] == [None, None]
    payload = found["payload"]
    assert payload["low"] <= 0.3 <= payload["high"]
    assert payload["high"] - payload["low"] < 0.2
    assert main(["identify", str(tmp_path / "log.csv")]) == 2  # the picture is there


def test_logs_that_will_not_do_are_refused():
    t = np.linspace(0.0, 1.0, 50)
    for change, match in (
        ({"times": t[::-1]}, "increasing"),
        ({"angles": t[:40]}, "shape"),
        ({"torques": np.full(50, np.nan)}, "finite"),
        ({"angles": (9 * t + 3) % (2 * np.pi)}, "jump by a turn; .*unwrap"),
    ):
        with pytest.raises(ValueError, match=match):
            WalkLog(**{"times": t, "torques": t, "angles": t} | change)
    with pytest.raises(ValueError, match="payload"):
        identify(BipedParams.from_bars(), WalkLog(t, t, t), ["mass"])


def test_a_head_behind_a_hash_names_columns_and_units(tmp_path):
    t, path = 5.0 * np.arange(40), tmp_path / "log.csv"
    columns = np.stack([t, 90 + t, 0.1 + 0 * t], axis=1)
    units = {"N m": 1.0, "Ncm": 0.01, "kgf*cm": 0.0980665, "lbf ft": 1.3558179}
    for (mark, angle), unit in product(((",", "crank angle"), (" ", "theta")), units):
        head = mark.join(["time [ms]", f"{angle} [deg]", f"torque [{unit}]"])
        np.savetxt(path, columns, delimiter=mark, header=f"of Monday\n{head}")
        log = WalkLog.from_file(path)
        read = [log.times[1], log.torques[1], log.angles[0]]
        np.testing.assert_allclose(read, [5e-3, 0.1 * units[unit], np.pi / 2])
    np.savetxt(path, columns * [1e-3, 1, 1], header="of Monday, in s")  # names no column
    assert WalkLog.from_file(path).torques[0] == 90


@pytest.mark.long
@pytest.mark.parametrize(
    ("floor", "payload", "rate", "delay", "bias"),
    [
        ((0.05, 0.04), 1.0, 2.6, 0.0, 0.0),
        ((0.15, 0.12), 0.5, 4.6, 0.0, 0.0),
        ((0.03, 0.03), 5.0, 1.9, 0.0, 0.0),
        ((0.05, 0.04), 0.3, 2.6, 0.01, 0.02),
    ],
)
def test_ten_seconds_with_slips_give_friction_as_said(floor, payload, rate, delay, bias):
    log, _ = log_of(*floor, payload, 10.0, rate, delay=delay, bias=bias)
    errors = ("encoder_bias", "encoder_delay") if delay else ()
    found = identify(BipedParams.from_bars(), log, ("payload", *errors)).parameters
    for name, true in zip(("mu_static", "mu_kinetic"), floor, strict=True):
        value, low, high = found[name]
        assert abs(value / true - 1) < max(0.02, (high - low) / (2 * true))  # 2 %, or as told
    assert abs(found["payload"].value - payload) < max(0.01 * payload, 0.005)
    for name, true in zip(errors, (bias, delay), strict=False):
        assert found[name].low <= true <= found[name].high
