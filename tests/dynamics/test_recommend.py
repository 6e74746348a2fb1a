"""Recommendations and presets are the cheapest measured points that do what is asked."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.tradeoff.scenes import PERIOD, WALKS
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import EventExact, RK4Split, Table, prepare, simulate
from stickslip.dynamics.biped.settings import (
    MEASURED_PRESETS,
    MEASUREMENTS,
    PRESET_BATCH,
    PRESET_SCENE,
    PRESETS,
    SCENES,
    WALK_PER_RADIAN,
    Setting,
    recommend,
    scene_class,
)
from stickslip.dynamics.fronts import front, knee
from tests.dynamics.helpers import FINE, default_params

BATCHES = (1, 4096)
TOLERANCES = tuple(10.0**k for k in range(-12, 1))


def asked(tolerance: float, scene: str, batch: int, **options):
    """The recommendation, or None where it is refused."""
    try:
        return recommend(tolerance, scene, batch, **options)
    except ValueError:
        return None


def walked(name: str, fidelity, integrator, dtype: str):
    """Crank angles and slides at the ends of the control periods of a measured walk."""
    walk = WALKS[name]

    def torque(state):
        return walk.gain * (walk.wanted_rate - state.crank_rate)

    with jax.enable_x64(dtype == "float64"):
        model = jax.jit(lambda robot: prepare(robot, fidelity=fidelity))(default_params(dtype))
        states = simulate(
            model,
            walk.scene(dtype),
            walk.start(dtype),
            torque,
            walk.duration,
            PERIOD,
            integrator=integrator,
        ).states
    angle = np.asarray(states.phase, float) + np.pi * np.asarray(states.steps)
    return angle, np.asarray(states.foot_position, float)


@pytest.mark.long
def test_the_recommended_setting_meets_its_tolerance_when_run_again():
    tolerance, name = 2e-2, "stick-slip"
    setting = recommend(tolerance, name, batch=4096).setting
    found = walked(name, setting.fidelity, setting.integrator_over(PERIOD), setting.dtype)
    truth = walked(name, FINE, EventExact(rtol=1e-11, atol=1e-13), "float64")
    duration = WALKS[name].duration
    angle, slide = (np.max(np.abs(a - b)) / duration for a, b in zip(found, truth, strict=True))
    assert 0 < angle <= tolerance
    assert 0 < slide <= tolerance * WALK_PER_RADIAN


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("scene", SCENES)
def test_no_measured_setting_is_cheaper_and_good_enough(scene, batch):
    for tolerance in TOLERANCES:
        found = asked(tolerance, scene, batch)
        if found is None:
            continue
        assert found.error <= tolerance
        for point in MEASUREMENTS:
            if (point.scene, point.batch) == (found.scene, found.batch):
                assert point.error > tolerance or point.cost >= found.cost


@pytest.mark.parametrize("dtype", [None, "float32", "float64"])
@pytest.mark.parametrize("scene", SCENES)
def test_a_looser_tolerance_never_costs_more(scene, dtype):
    for batch in BATCHES:
        answers = [asked(t, scene, batch, dtype=dtype) for t in TOLERANCES]
        costs = [math.inf if found is None else found.cost for found in answers]
        assert costs == sorted(costs, reverse=True)
        assert dtype is None or all(f.setting.dtype == dtype for f in answers if f is not None)


def test_a_tolerance_that_nothing_meets_is_refused_with_the_best_there_is():
    with pytest.raises(ValueError, match=r"tolerance = 1e-15 rad/s .* accepted: from [\d.e-]+ rad"):
        recommend(1e-15, "stick-slip")
    with pytest.raises(ValueError, match="and 1e-16 m/s: no measured setting"):
        recommend(1e-2, "stick-slip", slide_tolerance=1e-16)


def test_the_slide_has_its_own_tolerance_where_one_is_given():
    loose = recommend(1e-2, "stick-slip", slide_tolerance=1.0)
    tight = recommend(1e-2, "stick-slip", slide_tolerance=1e-7)
    assert loose.cost <= tight.cost
    assert tight.error < 1e-2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0.0"),
        ({"tolerance": math.nan}, "tolerance = nan"),
        ({"tolerance": 1e-3, "batch": 0}, "batch = 0; accepted: an integer >= 1"),
        ({"tolerance": 1e-3, "batch": True}, "batch = True"),
        ({"tolerance": 1e-3, "scene": "moon"}, "scene = 'moon' is unknown; accepted: 'smooth'"),
        ({"tolerance": 1e-3, "scene": None}, "scene = None"),
        ({"tolerance": 1e-3, "dtype": "float16"}, "dtype = 'float16' is unknown"),
        ({"tolerance": 1e-3, "slide_tolerance": -1.0}, "slide_tolerance = -1.0"),
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
        scene_class(Scene.smoothed(0.3))


def test_the_nearest_measured_batch_answers():
    assert recommend(1e-2, "smooth", 16).batch == 1
    assert recommend(1e-2, "smooth", 500).batch == 4096
    assert recommend(1e-2, "smooth", 10**6).batch == 4096


def test_presets_are_points_of_the_measured_front():
    points = [p for p in MEASUREMENTS if (p.scene, p.batch) == (PRESET_SCENE, PRESET_BATCH)]
    fast, balanced, exact = (MEASURED_PRESETS[name] for name in ("fast", "balanced", "exact"))
    for chosen in (fast, balanced, exact):
        for point in points:
            assert point.cost >= chosen.cost or point.error > chosen.error
    assert fast.error <= 1e-2
    assert exact.error <= max(1e-8, min(point.error for point in points))
    assert fast.cost <= balanced.cost <= exact.cost
    assert fast.error >= balanced.error >= exact.error
    assert {name: found.setting for name, found in MEASURED_PRESETS.items()} == PRESETS
    assert fast == recommend(1e-2, PRESET_SCENE, PRESET_BATCH)


def test_a_front_leaves_out_what_is_beaten_and_what_is_useless():
    costs = [1.0, 2.0, 3.0, 3.0, 4.0, 5.0]
    errors = [5.0, 1e-2, 1e-3, 1e-4, 1e-3, 1e-6]
    assert front(costs, errors) == [1, 3, 5]


def test_the_knee_is_where_a_front_bends():
    costs = [1.0, 10.0, 100.0, 1000.0]
    assert knee(costs, [1e-2, 1e-7, 1e-8, 1e-9]) == 1
    assert knee(costs, [1e-2, 1e-3, 1e-8, 1e-9]) == 2
    assert knee(costs[:2], [1e-2, 1e-3]) == 1
    with pytest.raises(ValueError, match="no front"):
        knee(costs, [1.0, 0.9, 0.8, 0.7])


def test_settings_with_equal_meaning_are_equal():
    assert Setting("table", "rk4_split", 0.01) == Setting(Table(), RK4Split(), 0.01)
    assert len({Setting(), Setting("table"), Setting("reduced")}) == 2


def test_a_control_period_is_divided_into_steps_no_longer_than_dt():
    assert Setting(dt=0.005).integrator_over(0.02) == RK4Split(substeps=4)
    assert Setting(dt=0.006).integrator_over(0.02) == RK4Split(substeps=4)
    assert Setting(dt=0.1).integrator_over(0.02) == RK4Split(substeps=1)
    exact = EventExact(rtol=1e-6)
    assert Setting(integrator=exact).integrator_over(0.02) == exact


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fidelity": "guess"}, "fidelity = 'guess' is unknown"),
        ({"integrator": "verlet"}, "integrator = 'verlet' is unknown"),
        ({"dt": -1.0}, "dt = -1.0 is not accepted"),
        ({"dtype": "bfloat16"}, "dtype = 'bfloat16' is unknown"),
    ],
)
def test_a_setting_refuses_what_it_does_not_know(options, message):
    with pytest.raises(ValueError, match=message):
        Setting(**options)
    with pytest.raises(ValueError, match=r"period = 0\.0"):
        Setting().integrator_over(0.0)


def test_every_measurement_is_a_number_that_can_be_compared():
    for point in MEASUREMENTS:
        assert point.scene in WALKS
        assert point.cost > 0
        assert 0 <= point.error < math.inf
        assert jnp.dtype(point.setting.dtype) in (jnp.float32, jnp.float64)
