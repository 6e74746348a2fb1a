"""What problems, objectives and results give out is a copy, or cannot be written to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.ugv import Track
from stickslip.envs.tasks import TASKS
from stickslip.optim import FunctionProblem, GaitProblem, Objective, OptimStatus, Result, suite
from tests.optim.instances.toys import HIGH, LOW, bowl, toy
from tests.optim.posture.helpers import tiny

X = np.array([0.5, -0.5])


def evaluated():
    it = toy().objective()
    it(X)
    return it


def recorded_front():
    it = toy(goals=2).objective()
    it([0.0, 0.0])
    return it.record


def gait():
    problem = GaitProblem.periodic(BipedParams.from_bars(), mu=0.3, steps=8)
    return problem.gait(np.array([4.0, *np.zeros(9)]))


MAKERS = {
    "objective": evaluated,
    "record": lambda: evaluated().record,
    "front": recorded_front,
    "function problem": lambda: evaluated().problems[0],
    "free problem": lambda: evaluated().free[0],
    "posture problem": lambda: tiny(start_angles=(1.3, 1.9), friction=np.full(4, 0.5)),
    "free angles": lambda: tiny(start_angles=(1.3, 1.9)).free,
    "gait problem": lambda: GaitProblem.periodic(BipedParams.from_bars(), mu=[0.3], steps=8),
    "gait": gait,
    "known": lambda: next(iter(suite("gait").values())).known,
    "known front": lambda: next(one.known for one in suite("goals").values() if one.known),
    "result": lambda: Result("by hand", OptimStatus.FAILED, np.ones(2), 1.0),
    "spline": lambda: Track.from_points([0.0, 1.0, 2.0], [0.0, 0.1, 0.0]),
    "rough ground": lambda: Track.named("rough", key=7, end=10.0),
    "tasks": lambda: SimpleNamespace(tasks=TASKS),
}


def arrays(value: object, name: str, depth: int = 4) -> Iterator[tuple[str, np.ndarray]]:
    """All arrays in tuples, lists, mappings and dataclasses."""
    if isinstance(value, np.ndarray):
        yield name, value
    elif depth == 0:
        return
    elif isinstance(value, dict | tuple | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, one in items:
            yield from arrays(one, f"{name}[{key}]", depth - 1)
    elif is_dataclass(value) and not isinstance(value, type):
        for one in fields(value):
            yield from arrays(getattr(value, one.name), f"{name}.{one.name}", depth - 1)


def given_out(one: object) -> dict[str, np.ndarray]:
    """What the public attributes of an object hold."""
    names = {*dir(type(one)), *vars(one)}
    public = [name for name in sorted(names) if not name.startswith("_")]
    values = {name: getattr(one, name) for name in public}
    return dict(pair for name, value in values.items() for pair in arrays(value, name))


@pytest.mark.parametrize("name", MAKERS)
def test_nobody_can_write_to_what_an_object_keeps(name: str):
    one = MAKERS[name]()
    first, again = given_out(one), given_out(one)
    kept = [name for name in first if np.shares_memory(first[name], again[name])]
    assert not [name for name in kept if first[name].flags.writeable]


def test_what_glue_does_to_an_answer_changes_no_other():
    it = evaluated()
    for ask in (it.constraints, it.gradient, it.jacobian, it.batch, it.violation, it.expand):
        before = np.array(ask(X))
        answer = ask(X)
        answer *= -1
        np.testing.assert_array_equal(ask(X), before)
    several = toy(goals=2).objective()
    values = several(X)
    values *= 2
    np.testing.assert_array_equal(several(X), values / 2)


def test_a_problem_keeps_what_it_was_given():
    friction, data = np.full(4, 0.5), np.array(0.25)
    problem = tiny(friction=friction)
    it = Objective((FunctionProblem(bowl, data, LOW, HIGH),))
    before = it(X)
    friction[:] = data[()] = 0.0
    assert np.all(problem.friction == 0.5)
    assert it(X + 1e-3) != before
    assert it(X) == before
