"""No recorded point of the biped's instances owes its value to the setting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from stickslip.dynamics.biped import RK4Split
from stickslip.optim import GaitProblem, Instance, instance
from stickslip.optim.instances.biped.gait import Interpolated
from stickslip.optim.instances.biped.instances import instances
from stickslip.optim.instances.biped.linkage import ANGLES, BipedDesign

PART = 16
"""Steps, nodes or angles in place of one."""
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
        return Interpolated(replace(problem, cells=PART * problem.cells), problem.cells)
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
@pytest.mark.parametrize("name", [one.id for one in instances()])
def test_a_recorded_point_is_worth_what_it_is_worth_in_a_sixteenth_of_the_step(name):
    owed = owed_by(instance(name))
    assert owed.value <= LIMIT
    assert owed.margin <= LIMIT
