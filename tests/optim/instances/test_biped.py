"""The biped's instances: no recorded point owes its value to the setting; each is what it says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped import RK4Split, simulate
from stickslip.optim import GaitProblem, Instance, instance, suite
from stickslip.optim.gait.convex.conic import best_of
from stickslip.optim.instances import biped
from stickslip.optim.instances.biped import ANGLES, BipedDesign, Interpolated, gait_problem
from tests.trees import differences

PART = 16
"""Steps, nodes or angles in place of one."""
BIPEDS = ("gait-", "shoot-", "gains-", "design-biped-", "goals-gait-")
LIMIT = 0.01
"""The most that a value may owe, in parts of it, and a scaled limit."""


class Owed(NamedTuple):
    """value: by how much the point's value is worse when it is computed finely, in parts of it.
    margin: by how much it misses a scaled limit then. With several goals the worst of all."""

    value: float
    margin: float


def owed_by(instance: Instance) -> Owed:
    """What the recorded points owe."""
    known = instance.known
    finer = replace(instance)
    finer.__dict__["problems"] = tuple(_finer(one) for one in instance.problems)
    found = [(instance.value(x)[0], finer.value(x)[0]) for x in np.atleast_2d(known.x)]
    value = max(float(np.max((fine - own) / np.abs(own))) for own, fine in found)
    margins = [finer.problem.free.constraints(x) for x in np.atleast_2d(known.x)]
    return Owed(value, max(0.0, -float(np.min(margins, initial=0.0))))


def _finer(problem: Any) -> Any:
    """The same in a sixteenth of the step."""
    if isinstance(problem, GaitProblem):
        return Interpolated(fine=replace(problem, cells=PART * problem.cells), cells=problem.cells)
    if isinstance(problem, Interpolated):
        return replace(problem, fine=replace(problem.fine, cells=PART * problem.fine.cells))
    function: Any = problem.function
    if isinstance(function, BipedDesign):
        function = replace(function, angles=PART * (function.angles or ANGLES))
    else:
        own = function.integrator or RK4Split()
        steps = replace(own, substeps=PART * own.substeps, max_events=PART * own.max_events)
        function = replace(function, integrator=steps)
    return replace(problem, function=function)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in suite() if name.startswith(BIPEDS)])
def test_a_recorded_point_is_worth_what_it_is_worth_in_a_sixteenth_of_the_step(name):
    owed = owed_by(instance(name))
    assert owed.value <= LIMIT
    assert owed.margin <= LIMIT


def test_a_straight_acceleration_is_the_same_motion_on_the_finer_grid():
    with jax.enable_x64(True):
        few, coarse = gait_problem("time", 10, 4, mu=0.3), gait_problem("time", 10, mu=0.3)
    assert isinstance(few, Interpolated)
    assert isinstance(coarse, GaitProblem)
    x = np.r_[20.0, np.linspace(1.0, -1.0, 9)]
    own, whole = coarse.gait(x), few.fine.gait(few.matrix @ x)
    np.testing.assert_allclose(whole.b[:, ::4], own.b, rtol=1e-12)
    np.testing.assert_allclose(whole.a[:, ::4], own.a, atol=1e-12)
    assert few.objective(x) == pytest.approx(coarse.objective(x), rel=1e-3)
    assert np.min(few.constraints(x)) <= np.min(coarse.constraints(x)) + 1e-9
    slopes, rows = (differences(of, x, 1e-4) for of in (few.objective, few.constraints))
    np.testing.assert_allclose(few.gradient(x), slopes, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(few.jacobian(x), rows, rtol=1e-4, atol=1e-6)


def test_its_program_in_cvxpy_keeps_accelerations_straight_and_limits_everywhere():
    with jax.enable_x64(True):
        few, coarse = gait_problem("time", 10, 4, mu=0.3), gait_problem("time", 10, mu=0.3)
    values = []
    for problem in (few, coarse):
        program, found = problem.in_cvxpy()
        program.solve(solver="CLARABEL")
        x = found()
        assert problem.is_feasible(x)
        values.append(problem.objective(x))
    assert values[0] > 1.01 * values[1]  # what the few nodes did not see
    proved = best_of(few.on_grid, every=False).certificate.bound
    assert proved * (1 - 1e-9) <= values[0] <= proved * (1 + 1e-6)


@pytest.mark.long
def test_gains_draw_floors_and_falls_cost():
    with jax.enable_x64(True):
        problem = biped.gains_problem(2, 3.0, 4)
    good, none = np.array([1.0, 0.3]), np.array([0.0, -2.0])
    drawn = [problem.drawn(i).objective(good) for i in range(3)]
    assert len(set(drawn)) == 3
    assert max(drawn) < problem.objective(none)


@pytest.mark.long
@pytest.mark.parametrize("scene", ["slippery", "patch"])
def test_shooting_is_the_simulator_s_walk(scene):
    with jax.enable_x64(True):
        problem = biped.shooting_problem(scene, 6)
        x = np.linspace(0.5, -0.3, 6)
        model, floor, state = problem.data
        torques = np.repeat(x, biped.HELD)
        walk = simulate(model, floor, state, torques, len(torques) * biped.DT, biped.DT)
        rate = np.asarray(walk.states.crank_rate)[1:]
        slid = float(np.sum(np.asarray(walk.contacts.slide_distance)))
    assert int(walk.status) <= 1
    expected = np.mean((rate / 3 - 1) ** 2 + biped.TORQUE_WEIGHT * (torques / 4) ** 2)
    assert problem.objective(x) == pytest.approx(expected + biped.SLIDE_WEIGHT * slid, rel=1e-9)
    slopes = differences(problem.objective, x, 1e-6)
    assert problem.gradient(x) == pytest.approx(slopes, rel=1e-4, abs=1e-6)


@pytest.mark.long
def test_the_reference_robot_as_a_design_is_the_reference_robot():
    one = instance("design-biped-friction-d12-v2")
    value, feasible = one.value(np.ones(12))
    assert feasible
    assert value[0] == pytest.approx(0.0797, abs=5e-4)  # 0.08 at 3 rad/s in the chapter
    assert one.best_known < 0.7 * value[0]


@pytest.mark.long
def test_robots_that_cannot_walk_are_bounded_and_no_better_than_those_that_do():
    one = instance("design-biped-energy-d12-v1")
    objective = one.objective()
    draws = np.random.default_rng(0).uniform(size=(64, one.n))
    for box in (1.0, 0.25):  # of the whole, and a quarter of it about the reference
        X = objective.from_unit(0.5 + box * (draws - 0.5))
        value, margins = objective.batch_with_constraints(X)
        assert np.all((value >= 0) & (value < 1e6))
        assert np.all(np.abs(margins) < 1e4)
        assert np.min(objective.penalised_batch(X)) > one.best_known
