"""The reference robot as a design."""

import jax
import numpy as np
import pytest

from stickslip.optim import instance
from stickslip.optim.instances.biped.linkage import within


@pytest.mark.long
def test_the_reference_robot_as_a_design_is_the_reference_robot():
    one = instance("design-biped-friction-d12-v2")
    value, feasible = one.value(np.ones(12))
    assert feasible
    assert value[0] == pytest.approx(0.0797, abs=5e-4)  # 0.08 at 3 rad/s in the chapter
    assert one.best_known < 0.7 * value[0]


DESIGNS = ("friction-d12-v2", "energy-d12-v1", "energy-masses-d14-v1")


@pytest.mark.parametrize(
    ("design", "count"),
    [
        ("energy-d12-v1", 64),
        *(pytest.param(one, 1024, marks=pytest.mark.long) for one in DESIGNS),
    ],
)
def test_robots_that_cannot_walk_are_bounded_and_no_better_than_those_that_do(design, count):
    one = instance(f"design-biped-{design}")
    objective = one.objective()
    draws = np.random.default_rng(0).uniform(size=(count, one.n))
    for box in (1.0, 0.25):  # of the whole, and a quarter of it about the reference
        X = objective.from_unit(0.5 + box * (draws - 0.5))
        value, margins = objective.batch_with_constraints(X)
        assert np.all((value >= 0) & (value < 1e6))
        assert np.all(np.abs(margins) < 1e4)
        assert np.min(objective.penalised_batch(X)) > one.best_known


@pytest.mark.long
@pytest.mark.parametrize("design", DESIGNS)
def test_the_recorded_robot_has_its_recorded_value_to_the_last_digits(design):
    one = instance(f"design-biped-{design}")
    value, feasible = one.value(one.known.x)
    assert feasible
    assert value[0] == pytest.approx(one.best_known, rel=1e-12)


def test_what_is_out_of_all_bounds_grows_by_its_logarithm_from_there_on():
    x = np.array([-1e20, -100.0, -3.0, 0.0, 100.0, 100 * np.e])
    expected = [-100 * (1 + 18 * np.log(10)), -100, -3, 0, 100, 200]
    np.testing.assert_allclose(within(x, 100.0), expected, rtol=1e-6)
    slope = jax.grad(within)
    assert float(slope(100.0 * (1 - 1e-6), 100.0)) == 1.0
    assert float(slope(100.0 * (1 + 1e-6), 100.0)) == pytest.approx(1.0, rel=1e-5)
