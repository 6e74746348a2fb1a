"""Recommendations and presets are the cheapest measured points that keep what they promise."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import binom

from benchmarks.tradeoff import walks as measured
from benchmarks.tradeoff.walks import draw, errors, paths, walked
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import EventExact, RK4Split
from stickslip.dynamics.biped.recommendation import (
    PRESET_BATCH,
    PRESET_SCENE,
    PRESETS,
    QUANTILES,
    SCENES,
    promises,
    recommend,
    scene_class,
)
from stickslip.dynamics.biped.settings import Setting
from tests.dynamics.biped.helpers import default_params

BATCHES = (1, 4096)
TOLERANCES = tuple(10.0**k for k in range(-12, 1))


def asked(tolerance: float, scene: str, batch: int, **options):
    """The recommendation, or None where it is refused."""
    try:
        return recommend(tolerance, scene, batch, **options)
    except ValueError:
        return None


def violations(floor: str, robots: str, setting: Setting, count: int) -> np.ndarray:
    """Errors of a setting on walks that were not measured, each for a second [rad/s]."""
    with jax.enable_x64(True):
        walks = draw(floor, range(measured.HELD_OUT, measured.HELD_OUT + count), robots)
    truth = paths(walks, measured.REFERENCE)
    off = errors(walks, paths(walks, setting), truth)[0]
    return off[walked(truth) >= measured.SHORTEST]


@pytest.mark.long
@pytest.mark.parametrize("robots", ["default", "others"])
@pytest.mark.parametrize("floor", measured.FLOORS)
def test_the_promise_for_1e_5_is_kept_on_walks_that_were_not_measured(floor, robots):
    params = None if robots == "default" else default_params("float32")
    found = recommend(1e-5, floor, batch=4096, params=params)
    off = violations(floor, robots, found.setting, 192)
    within = np.sum(off <= found.promised_error)
    assert len(off) > 150
    assert within >= binom.ppf(1e-3, len(off), found.quantile)
    assert np.median(off) <= found.typical_error * 2
    print(f"{floor}, {robots}: {within} of {len(off)} within {found.promised_error:.1e} rad/s")


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("scene", SCENES)
def test_no_measured_setting_is_cheaper_and_good_enough(scene, batch):
    for tolerance in TOLERANCES:
        found = asked(tolerance, scene, batch)
        if found is None:
            continue
        assert found.promised_error <= tolerance
        for point in promises("default"):
            if (point.scene, point.batch) == (found.scene, found.batch):
                assert point.promised_error > tolerance or point.cost >= found.cost


def test_a_tolerance_that_nothing_meets_is_refused_with_the_best_there_is():
    with pytest.raises(ValueError, match=r"1e-15: no .* 95 % .* from [\d.e-]+$") as caught:
        recommend(1e-15, "stick-slip")
    best = float(str(caught.value).split("from ")[1].split()[0])
    assert recommend(1.1 * best, "stick-slip").promised_error == pytest.approx(best, rel=0.05)


def test_a_promise_says_how_many_walks_keep_it():
    found = recommend(1e-2)
    assert found.typical_error <= found.promised_error <= 1e-2
    assert found.quantile == 0.95
    assert found.count >= 400
    assert 0 <= found.otherwise < 0.2


def test_more_walks_in_a_promise_make_it_no_cheaper():
    costs = [recommend(1e-2, "smooth", quantile=q).cost for q in QUANTILES]
    assert costs == sorted(costs)


def test_steps_errors_and_costs_scale_with_the_robots_own_time():
    robot = default_params("float32")
    small = replace(robot, crank=jnp.asarray(0.030 / 4))
    one = recommend(1e-4, "ice", params=robot)
    two = recommend(2e-4, "ice", params=small)
    assert two.setting == replace(one.setting, dt=two.setting.dt)
    assert two.setting.dt == pytest.approx(one.setting.dt / 2)
    for name in ("promised_error", "typical_error", "cost"):
        assert getattr(two, name) == pytest.approx(2 * getattr(one, name))
    both = recommend(2e-4, "ice", params=replace(robot, crank=jnp.asarray([0.03, 0.0075])))
    assert both.setting == two.setting


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0.0"),
        ({"tolerance": 1e-3, "scene": "moon"}, "scene = 'moon' is unknown; accepted: 'smooth'"),
        ({"tolerance": 1e-3, "quantile": 0.9}, "quantile = 0.9 is not measured; accepted: 0.5"),
        ({"tolerance": 1e-3, "params": 0.03}, "params = 0.03; accepted: BipedParams"),
    ],
)
def test_bad_questions_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        recommend(**arguments)


def test_a_scene_is_judged_by_its_floor():
    assert scene_class(Scene.grip()) == "smooth"
    assert scene_class(Scene.uniform(0.3)) == "stick-slip"
    assert scene_class(Scene.patches([0.3], [0.5, 0.05])) == "ice"
    assert recommend(1e-2, Scene.uniform(0.3)) == recommend(1e-2, "stick-slip")
    with pytest.raises(ValueError, match="nothing is measured for it"):
        scene_class(Scene(floor=None))


def test_presets_are_points_of_the_measured_front():
    wanted = (PRESET_SCENE, PRESET_BATCH)
    points = [p for p in promises("default") if (p.scene, p.batch) == wanted]
    presets = [PRESETS[name] for name in ("fast", "balanced", "exact")]
    fast, balanced, exact = (next(p for p in points if p.setting == one) for one in presets)
    for chosen in (fast, balanced, exact):
        for point in points:
            other = chosen is not exact and point.setting.dtype == "float64"
            worse = point.promised_error > chosen.promised_error
            assert other or point.cost >= chosen.cost or worse
    assert fast.promised_error <= 2e-2
    assert exact.promised_error <= max(1e-8, min(point.promised_error for point in points))
    assert fast.cost <= balanced.cost <= exact.cost
    assert fast.promised_error >= balanced.promised_error >= exact.promised_error
    assert {fast.setting.dtype, balanced.setting.dtype} == {"float32"}  # needs no switch


def test_a_control_period_is_divided_into_steps_no_longer_than_dt():
    assert Setting(dt=0.005).integrator_over(0.02) == RK4Split(substeps=4)
    assert Setting(dt=0.006).integrator_over(0.02) == RK4Split(substeps=4)
    assert Setting(dt=0.1).integrator_over(0.02) == RK4Split(substeps=1)
    exact = EventExact(rtol=1e-6)
    assert Setting(integrator=exact).integrator_over(0.02) == exact


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"integrator": "verlet"}, "integrator = 'verlet' is unknown"),
        ({"dt": -1.0}, "dt = -1.0 is not accepted"),
    ],
)
def test_a_setting_refuses_what_it_does_not_know(options, message):
    with pytest.raises(ValueError, match=message):
        Setting(**options)
    with pytest.raises(ValueError, match=r"period = 0\.0"):
        Setting().integrator_over(0.0)
