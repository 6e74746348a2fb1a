"""Every verdict is computed: fed a case that it does not hold for, it comes out otherwise."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.optim import Station
from stickslip.paper import bump, slip, start, steady
from stickslip.paper.bump import Held
from stickslip.paper.figure import share_of
from stickslip.paper.slides import Slide, Walk

AGREES, PARTLY, DIFFERS = "agrees", "partly", "differs"
CALIBRATED, CONSTRUCTED = "by calibration", "by construction"


def a_walk(*slides: Slide) -> Walk:
    """Four steps, the foot moving evenly during each slide."""
    share = np.linspace(0, 4, 97)
    place = sum(
        one.displacement * np.clip((share - one.start) / (one.end - one.start), 0, 1)
        for one in slides
    )
    return Walk(1.0, share, place + 0 * share, slides)


def every_step(*slides: Slide) -> Walk:
    return a_walk(
        *(
            replace(one, start=one.start + step, end=one.end + step)
            for step in range(4)
            for one in slides
        )
    )


RESTS = a_walk()


def test_all_some_and_none_give_three_verdicts():
    assert [share_of(s) for s in ([1, 1], [1, 0], [0, 0], [])] == [AGREES, PARTLY, DIFFERS, DIFFERS]


@pytest.mark.parametrize(
    ("at_one", "at_two", "verdict"),
    [(0.02, 0.08, AGREES), (0.05, 0.2, PARTLY), (0.2, 0.8, DIFFERS)],
)
def test_fig11_curves_hardly_differ_by_their_gap(at_one, at_two, verdict):
    assert steady.hardly({1.0: at_one, 2.0: at_two, 3.0: 9 * at_one}).verdict == verdict


@pytest.mark.parametrize(
    ("alike", "verdict"),
    [
        ([0.999, 0.99, 0.98, 0.97, 0.9], AGREES),
        ([0.999, 0.99, 0.98, 0.97, 0.96], PARTLY),
        ([0.999, 0.98, 0.9, 0.8, 0.7], PARTLY),
        ([0.9, 0.8, 0.7, 0.6, 0.5], DIFFERS),
    ],
)
def test_fig11_one_speed_stands_apart_only_if_the_others_keep_the_shape(alike, verdict):
    by_speed = dict(zip((1.0, 2.0, 3.0, 4.0, 5.0), alike, strict=True))
    assert steady.same_shape(by_speed).verdict == verdict


@pytest.mark.parametrize(
    ("gaps", "verdict"), [((0.1, 0.2), DIFFERS), ((0.05, 0.2), PARTLY), ((0.01, 0.02), AGREES)]
)
def test_fig12_a_load_changes_the_torque_slightly_by_its_gap(gaps, verdict):
    change = dict(zip((5.0, 15.0), gaps, strict=True))
    assert steady.slightly(change, change, 8.0).verdict == verdict


@pytest.mark.parametrize(
    ("height", "still", "verdict"),
    [(0.001, 0.05, AGREES), (0.001, 0.5, PARTLY), (0.1, 0.05, PARTLY), (0.1, 0.5, DIFFERS)],
)
def test_fig12_the_level_hip_is_the_reason_only_if_loads_change_little_at_rest(
    height, still, verdict
):
    assert steady.level(height, 0.24, {15.0: still}).verdict == verdict


def test_fig13_the_start_torque_needs_both_methods():
    assert start.starts_at(0.8403, 0.84034).verdict == CALIBRATED
    assert start.starts_at(0.8403, 0.8410).verdict == DIFFERS
    assert start.starts_at(0.9003, 0.9003).verdict == DIFFERS


def test_fig14_scaling_holds_by_construction_unless_the_walks_break_it():
    times = {8.0: 0.7, 9.0: 0.8, 11.0: np.inf}
    assert start.heavier(times, 8.0, 0.8).verdict == CONSTRUCTED  # up to 10 kg
    for broken in ({8.0: 0.9}, {9.0: np.inf}, {11.0: 2.0}):
        assert start.heavier(times | broken, 8.0, 0.8).verdict == DIFFERS


def test_fig15_residuals_beyond_rounding_would_differ():
    zmp = np.array([-0.1, 0.2])

    def verdicts(linear, moment):
        return [claim.verdict for claim in steady.equations(linear, moment, 83.0, zmp)]

    assert verdicts(1e-13, 1e-14) == [CONSTRUCTED, CONSTRUCTED]
    assert verdicts(1e-6, 1e-14) == [DIFFERS, CONSTRUCTED]
    assert verdicts(1e-13, 1e-6) == [CONSTRUCTED, DIFFERS]


def test_fig15_a_force_left_out_leaves_a_residual():
    ground, tibia = np.array([[1.0, 83.0]]), np.array([[-1.0, -70.0]])
    bar, pin = np.array([[0.0, -10.0]]), np.array([[0.06, 0.0]])
    whole = steady.FootForces(ground, tibia, bar, np.array([0.6 / 83]))
    assert steady.residuals(whole, pin, 3.0) == pytest.approx((0, 0), abs=1e-12)
    linear, moment = steady.residuals(whole._replace(bar=0 * bar), pin, 3.0)
    assert (linear, moment) == (pytest.approx(10), pytest.approx(0.6))


def test_fig15_the_bar_that_keeps_its_length_is_the_foots():
    angles = np.linspace(0, 1, 5)
    ankle = np.zeros((5, 2, 2))
    rigid = np.stack([np.cos(angles), np.sin(angles)], -1)[:, None] + ankle
    stretched = rigid * (1 + angles)[:, None, None]

    def pins(knee, C):
        return SimpleNamespace(pins=SimpleNamespace(ankle_bar=ankle, knee_bar=knee, C_bar=C))

    assert steady.pinned(pins(rigid, stretched)).verdict == DIFFERS
    assert steady.pinned(pins(stretched, rigid)).verdict == AGREES


def test_fig16_a_walk_that_misses_a_state_of_the_chart_differs():
    states = [(slip.RESTS, 0.0, 0.4), (slip.FORWARDS, 0.4, 0.6), (slip.BACKWARDS, 1.0, 1.2)]
    assert slip.flow(states).verdict == CONSTRUCTED
    assert slip.flow(states[:2]).verdict == DIFFERS


def test_fig17_least_friction_needs_the_number_and_the_walks():
    slips = every_step(Slide(0.45, 0.6, 1e-3))
    use = np.array([0.02, 0.06, 0.07994, 0.06, 0.02])
    assert slip.least_friction({0.079: slips, 0.08: RESTS}, use).verdict == CALIBRATED
    for walks, needs in (
        ({0.079: slips, 0.085: slips, 0.09: RESTS}, use),
        ({0.08: RESTS}, 2 * use),
    ):
        assert slip.least_friction(walks, needs).verdict == DIFFERS


def test_fig17_slides_that_start_elsewhere_are_not_at_mid_step():
    middle, early = every_step(Slide(0.45, 0.6, 1e-3)), every_step(Slide(0.3, 0.6, 1e-3))
    once = a_walk(Slide(0.45, 0.6, 1e-3))  # not in the second step
    for walks, verdict in (
        ({0.05: middle, 0.1: RESTS}, AGREES),
        ({0.04: early, 0.05: middle}, PARTLY),
        ({0.04: early, 0.05: once}, DIFFERS),
        ({0.1: RESTS}, DIFFERS),
    ):
        assert slip.onset(walks).verdict == verdict


def test_fig17_slides_end_when_the_leg_is_highest_by_one_height_for_all():
    high = {"ankle": 0.5, "knee": 0.6}
    walks = {mu: every_step(Slide(0.45, end, 1e-3)) for mu, end in ((0.04, 0.61), (0.05, 0.58))}
    assert slip.end(walks, high).verdict == AGREES
    walks[0.03] = every_step(Slide(0.45, 0.51, 1e-3))
    assert slip.end(walks, high).verdict == PARTLY
    assert slip.end(walks, {"ankle": 0.8}).verdict == DIFFERS


@pytest.mark.parametrize(
    ("ends", "verdict"), [((0.1, 0.2), AGREES), ((0.1, 0.4), PARTLY), ((0.3, 0.4), DIFFERS)]
)
def test_fig17_the_other_slide_is_in_the_first_quarter_if_it_is_over_there(ends, verdict):
    middle = Slide(0.45, 0.6, 1e-3)
    walks = {
        mu: every_step(Slide(0.0, end, -1e-3), middle)
        for mu, end in zip((0.06, 0.05), ends, strict=True)
    }
    walks[0.03] = every_step(Slide(0.0, 0.44, -1e-3), middle)  # of a row of its own
    assert slip.second(walks).verdict == verdict
    late = {0.03: walks[0.03], 0.05: every_step(middle, Slide(0.8, 0.9, 1e-3))}
    assert slip.second(late).verdict == DIFFERS


def test_fig17_repeatedly_is_three_slides_a_step():
    three = every_step(*(Slide(at, at + 0.1, 1e-3) for at in (0.1, 0.4, 0.7)))
    long, short = every_step(Slide(0.1, 0.8, 1e-3)), every_step(Slide(0.1, 0.3, 1e-3))
    verdicts = [slip.repeatedly({0.03: one}).verdict for one in (three, long, short)]
    assert verdicts == [AGREES, PARTLY, DIFFERS]


def test_fig19_the_first_onset_is_one_by_construction_unless_it_is_not():
    early, late = every_step(Slide(0.4, 0.5, 1e-3)), every_step(Slide(0.45, 0.5, 1e-3))
    assert slip.first_onset({0.2: early, 0.1: early}).verdict == CONSTRUCTED
    assert slip.first_onset({0.2: early, 0.1: late}).verdict == DIFFERS
    assert slip.first_onset({0.2: early, 0.1: RESTS}).verdict == DIFFERS


def test_fig19_later_onsets_are_compared_one_by_one():
    first, middle = Slide(0.0, 0.1, 1e-3), Slide(0.45, 0.5, 1e-3)
    two, one = every_step(first, middle), every_step(middle)
    elsewhere = every_step(replace(middle, start=0.4))
    assert slip.later_onsets({0.2: two, 0.1: two}).verdict == AGREES
    assert slip.later_onsets({0.2: two, 0.1: one}).verdict == PARTLY
    assert slip.later_onsets({0.2: one, 0.1: elsewhere}).verdict == DIFFERS
    assert slip.later_onsets({0.2: one, 0.1: RESTS}).verdict == DIFFERS


def test_fig19_a_smaller_slide_is_less_distance_and_less_displacement():
    def there_and_back(out: float, back: float) -> Walk:
        return every_step(Slide(0.1, 0.3, out), Slide(0.5, 0.7, -back))

    little, much = there_and_back(2e-3, 1e-3), there_and_back(8e-3, 5e-3)
    returned = there_and_back(8e-3, 8e-3)
    assert slip.smaller_slide({0.2: little, 0.1: much}).verdict == AGREES
    assert slip.smaller_slide({0.2: little, 0.1: returned}).verdict == PARTLY
    assert slip.smaller_slide({0.2: much, 0.1: little}).verdict == DIFFERS
    measured = slip.smaller_slide({0.2: little, 0.1: there_and_back(1e-3, 2e-3)}).measured
    assert "+4.00, -4.00 mm" in measured


def test_fig24_a_posture_without_torque_or_one_that_lifts_is_seen():
    every = Held(((70, 70), (30, 100), (90, 90)), np.array([0.6, 0.7, 0.8]), some_stations(3))
    stations = every.stations
    assert bump.exists(every).verdict == CONSTRUCTED
    assert bump.passes(every).verdict == AGREES
    broken = every._replace(stations=stations._replace(torque=stations.torque * np.nan))
    assert bump.exists(broken).verdict == DIFFERS
    for lifted, verdict in ((1, PARTLY), (3, DIFFERS)):
        status = np.where(np.arange(3)[:, None] < lifted, Status.ROLLOVER, stations.status)
        found = every._replace(stations=stations._replace(status=status))
        assert bump.passes(found).verdict == verdict


def test_fig25_what_more_freedom_gains_is_by_construction_only_at_the_points():
    held, better, worse = a_drive(100.0, 101.0), a_drive(90.0, 91.0), a_drive(80.0, 300.0)

    def claims(limited, free):
        drives = dict(zip((bump.HELD, bump.LIMITED, bump.FREE), (held, limited, free), strict=True))
        return (
            bump.varies_less(drives, (70.0, 80.0)).verdict,
            bump.between(drives).verdict,
        )

    assert claims(better, better) == (CONSTRUCTED, AGREES)
    assert claims(better, worse) == (CONSTRUCTED, PARTLY)
    assert claims(worse, worse) == (CONSTRUCTED, DIFFERS)
    assert claims(a_drive(110.0, 90.0), better) == (DIFFERS, AGREES)


def test_fig25_a_drive_that_fails_between_its_points_does_not_pass():
    drive = a_drive(90.0, 91.0)
    assert bump.passes_turning(drive).verdict == AGREES
    status = np.array(drive.dense.status)
    status[-1] = Status.WHEEL_SLIP
    fails = drive._replace(dense=drive.dense._replace(status=status))
    assert bump.passes_turning(fails).verdict == DIFFERS


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
    return bump.Drive(some_stations(), variation, some_stations(points=31), between)
