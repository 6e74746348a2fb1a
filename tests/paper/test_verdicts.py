"""Every verdict is computed: fed a case that it does not hold for, it comes out otherwise."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.optim import Station
from stickslip.paper import bump, slip, start, steady
from stickslip.paper.bump import Held
from stickslip.paper.slides import Slide, Walk

AGREES, PARTLY, DIFFERS = "agrees", "partly", "differs"
CALIBRATED, CONSTRUCTED = "by calibration", "by construction"


def every_step(*slides: Slide) -> Walk:
    """Four steps, the foot moving evenly during each slide."""
    found = tuple(
        replace(one, start=one.start + step, end=one.end + step)
        for step in range(4)
        for one in slides
    )
    share = np.linspace(0, 4, 97)
    place = sum(
        one.displacement * np.clip((share - one.start) / (one.end - one.start), 0, 1)
        for one in found
    )
    return Walk(1.0, share, place + 0 * share, found)


def at(*ends: tuple[float, float]) -> Walk:
    """A walk whose foot slides 1 mm forwards from start to end in every step."""
    return every_step(*(Slide(a, b, 1e-3) for a, b in ends))


def back_and_forth(out: float, back: float) -> Walk:
    return every_step(Slide(0.1, 0.3, out), Slide(0.5, 0.7, -back))


def speeds(*shares: float) -> dict[float, float]:
    return {float(w): share for w, share in enumerate(shares, 1)}


RESTS, MIDDLE, EARLY = every_step(), at((0.45, 0.6)), at((0.3, 0.6))
USE = np.array([0.02, 0.06, 0.07994, 0.06, 0.02])
ZMP = np.array([-0.1, 0.2])
STATES = [(slip.RESTS, 0.0, 0.4), (slip.FORWARDS, 0.4, 0.6), (slip.BACKWARDS, 1.0, 1.2)]
HIGH = {"ankle": 0.5, "knee": 0.6}
TIMES = {8.0: 0.7, 9.0: 0.8, 11.0: np.inf}
FIRST_SLIDES = {
    end: every_step(Slide(0.0, end, -1e-3), Slide(0.45, 0.6, 1e-3)) for end in (0.1, 0.4)
}
TWO = at((0.0, 0.1), (0.45, 0.5))


@pytest.mark.parametrize(
    ("claim", "arguments", "verdict"),
    [
        (steady.hardly, [speeds(0.02, 0.08, 0.2)], AGREES),
        (steady.hardly, [speeds(0.2, 0.8, 2.0)], DIFFERS),
        (steady.same_shape, [speeds(0.999, 0.99, 0.98, 0.97, 0.9)], AGREES),
        (steady.same_shape, [speeds(0.9, 0.8, 0.7, 0.6, 0.5)], DIFFERS),
        (steady.slightly, [{5.0: 0.01}, {5.0: 0.01, 15.0: 0.02}, 8.0], AGREES),
        (steady.slightly, [{5.0: 0.01}, {5.0: 0.05, 15.0: 0.2}, 8.0], PARTLY),
        (steady.level, [0.001, 0.24, {15.0: 0.05}], AGREES),
        (steady.level, [0.1, 0.24, {15.0: 0.5}], DIFFERS),
        (start.starts_at, [0.8403, 0.84034], CALIBRATED),
        (start.starts_at, [0.9003, 0.9003], DIFFERS),
        (start.heavier, [TIMES, 8.0, 0.8], CONSTRUCTED),  # up to 10 kg
        (start.heavier, [TIMES | {8.0: 0.9}, 8.0, 0.8], DIFFERS),
        (slip.flow, [STATES], CONSTRUCTED),
        (slip.flow, [STATES[:2]], DIFFERS),
        (slip.least_friction, [{0.079: MIDDLE, 0.08: RESTS}, USE], CALIBRATED),
        (slip.least_friction, [{0.079: MIDDLE, 0.085: MIDDLE, 0.09: RESTS}, USE], DIFFERS),
        (slip.onset, [{0.05: MIDDLE, 0.1: RESTS}], AGREES),
        (slip.onset, [{0.1: RESTS}], DIFFERS),
        (slip.end, [{0.04: at((0.45, 0.61)), 0.05: at((0.45, 0.58))}, HIGH], AGREES),
        (slip.end, [{0.04: at((0.45, 0.61))}, {"ankle": 0.8}], DIFFERS),
        (slip.second, [{0.03: RESTS, 0.06: FIRST_SLIDES[0.1]}], AGREES),
        (slip.second, [{0.03: RESTS, 0.05: FIRST_SLIDES[0.4]}], DIFFERS),
        (slip.repeatedly, [{0.03: at((0.1, 0.2), (0.4, 0.5), (0.7, 0.8))}], AGREES),
        (slip.repeatedly, [{0.03: at((0.1, 0.3))}], DIFFERS),
        (slip.first_onset, [{0.2: EARLY, 0.1: EARLY}], CONSTRUCTED),
        (slip.first_onset, [{0.2: EARLY, 0.1: MIDDLE}], DIFFERS),
        (slip.later_onsets, [{0.2: TWO, 0.1: TWO}], AGREES),
        (slip.later_onsets, [{0.2: MIDDLE, 0.1: EARLY}], DIFFERS),
        (
            slip.smaller_slide,
            [{0.2: back_and_forth(2e-3, 1e-3), 0.1: back_and_forth(8e-3, 5e-3)}],
            AGREES,
        ),
        (
            slip.smaller_slide,
            [{0.2: back_and_forth(8e-3, 5e-3), 0.1: back_and_forth(2e-3, 1e-3)}],
            DIFFERS,
        ),
    ],
)
def test_a_verdict_follows_from_the_numbers(claim, arguments, verdict):
    assert claim(*arguments).verdict == verdict


def test_fig15_a_force_left_out_leaves_a_residual_and_residuals_differ():
    ground, tibia = np.array([[1.0, 83.0]]), np.array([[-1.0, -70.0]])
    bar, pin = np.array([[0.0, -10.0]]), np.array([[0.06, 0.0]])
    whole, zmp = {"ground": ground, "tibia": tibia, "bar": bar}, np.array([0.6 / 83])
    assert steady.residuals(whole, zmp, pin, 3.0) == pytest.approx((0, 0), abs=1e-12)
    linear, moment = steady.residuals(whole | {"bar": 0 * bar}, zmp, pin, 3.0)
    assert (linear, moment) == (pytest.approx(10), pytest.approx(0.6))
    verdicts = [one.verdict for one in steady.equations(1e-6, 1e-14, 83.0, ZMP)]
    assert verdicts == [DIFFERS, CONSTRUCTED]
    assert steady.equations(1e-13, 1e-6, 83.0, ZMP)[1].verdict == DIFFERS


def test_fig24_a_posture_without_torque_or_one_that_lifts_is_seen():
    every = Held(((70, 70), (30, 100), (90, 90)), some_stations(3))
    stations = every.stations
    assert bump.exists(every).verdict == CONSTRUCTED
    assert bump.passes(every).verdict == AGREES
    broken = every._replace(stations=stations._replace(torque=stations.torque * np.nan))
    assert bump.exists(broken).verdict == DIFFERS
    status = np.where(np.arange(3)[:, None] < 1, Status.ROLLOVER, stations.status)
    lifted = every._replace(stations=stations._replace(status=status))
    assert bump.passes(lifted).verdict == PARTLY


@pytest.mark.parametrize(
    ("limited", "free", "verdicts"),
    [
        ((90.0, 91.0), (90.0, 91.0), (CONSTRUCTED, AGREES)),
        ((80.0, 300.0), (80.0, 300.0), (CONSTRUCTED, DIFFERS)),
    ],
)
def test_fig25_what_more_freedom_gains_is_by_construction_only_at_the_points(
    limited, free, verdicts
):
    names = (bump.HELD, bump.LIMITED, bump.FREE)
    drives = {
        name: a_drive(*of) for name, of in zip(names, ((100.0, 101.0), limited, free), strict=True)
    }
    found = bump.varies_less(drives, (70.0, 80.0)).verdict, bump.between(drives).verdict
    assert found == verdicts


def some_stations(count: int | None = None, points: int = 4) -> Station:
    """Torques from 1 to 0 and loads of 10 N, with a grip that holds."""
    shape = (points,) if count is None else (count, points)
    one = np.ones(shape)
    numbers = dict.fromkeys(Station._fields, one) | {
        "x": np.linspace(0, 1, points) * one,
        "torque": np.linspace(1, 0, points) * one,
        "N_rear": 10 * one,
        "N_front": 10 * one,
        "status": np.zeros(shape, int),
    }
    return Station(**numbers)


def a_drive(variation: float, between: float) -> bump.Drive:
    return bump.Drive(some_stations(points=31), variation, between)
