"""One rule for every number that optim is given: refused by name, with what is accepted."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.dynamics.ugv import Track
from stickslip.optim import PostureProblem, solve
from tests.optim.posture.helpers import over_bump

BAD = ["1.0", True, [[1.0], [1.0, 2.0], [3.0]], 10**400, np.nan, 1j, object(), np.ones(3)]
NONE_TOO = [*BAD, None]


def ids(value) -> str:
    return type(value).__name__


def refused(name: str, call) -> None:
    with pytest.raises(ValueError, match=name) as refusal:
        call()
    assert "accepted" in str(refusal.value)
    assert len(str(refusal.value)) < 400


@pytest.mark.parametrize("bad", NONE_TOO, ids=ids)
def test_fields_of_a_problem(bad):
    for name in ("min_normal", "min_grip", "min_clearance", "friction", "x"):
        refused(name, lambda name=name: replace(over_bump(), **{name: bad}))
    for name in ("params", "track", "solver", "criterion"):
        refused(name, lambda name=name: replace(over_bump(), **{name: bad}))
    refused("spacing", lambda: PostureProblem.along(Track.bump(), spacing=bad))
    if bad is not None:
        for name in ("leg_rate", "start_angles", "end_angles"):
            refused(name, lambda name=name: replace(over_bump(), **{name: bad}))
        for name in ("start", "end"):
            refused(name, lambda name=name: PostureProblem.along(Track.bump(), **{name: bad}))


@pytest.mark.parametrize("bad", NONE_TOO, ids=ids)
def test_points(bad):
    problem = over_bump()
    for function in (problem.objective, problem.gradient, problem.is_feasible):
        refused("x", lambda function=function: function(bad))
    refused("x", lambda: problem.free.expand(bad))
    refused("x", lambda: problem.free.reduce(bad))


@pytest.mark.parametrize("bad", BAD, ids=ids)
def test_options_of_methods(bad):
    problem = over_bump()
    options = {
        "dp": ("angles",),
        "branch": ("start",),
        "scp": ("iterations", "radius", "tolerance", "start"),
        "gradient": ("iterations", "tolerance", "start"),
        "cma": ("seed", "evaluations", "sigma", "population", "penalty", "start"),
    }
    for method, names in options.items():
        for name in names:
            refused(name, lambda m=method, n=name: solve(problem, m, **{n: bad}))
    refused("problem", lambda: solve(bad))
    refused("method", lambda: solve(problem, bad))
    if bad is not True:
        refused("polish", lambda: solve(problem, polish=bad))
        refused("progress", lambda: solve(problem, progress=bad))


def test_unknown_options_are_told_the_nearest():
    with pytest.raises(ValueError, match=r"'angels' is no option of 'dp'.*did you mean angles\?"):
        solve(over_bump(), "dp", angels=3)
