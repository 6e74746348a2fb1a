"""Every method by name runs until its budget ends it, and finds what is on paper."""

import sys

import pytest

from stickslip.agents.optimisers import METHODS
from stickslip.agents.optimisers.methods import methods_of
from stickslip.optim import BudgetSpent, suite
from tests.optim.instances.toys import LEAST, toy

QUICK = {"cma": "cma", "slsqp": "", "cobyla": "", "random": ""}
DEAR = {"trust-constr": ""}


@pytest.mark.parametrize(
    ("name", "package"),
    [*QUICK.items(), *(pytest.param(*one, marks=pytest.mark.long) for one in DEAR.items())],
)
def test_a_method_minimises_until_its_budget_is_spent(name, package):
    if package:
        pytest.importorskip(package)
    objective = toy().objective(budget=300, seed=1)
    with pytest.raises(BudgetSpent):
        METHODS[name].function(objective, 1)
    assert objective.record.evaluations == 300
    near = 0.03 if name in ("cma", "slsqp", "cobyla", "trust-constr") else 0.3
    assert LEAST - 1e-5 < objective.record.best < LEAST + near


def test_methods_that_look_into_the_problem_find_the_best_known():
    one = suite()["gait-time-d16-v2"]
    objective = one.objective()
    METHODS["conic"].function(objective, 0)
    assert objective.record.best == pytest.approx(one.best_known, rel=1e-6)
    assert objective.record.evaluations == 1


def test_all_are_tried_and_each_says_what_it_takes():
    inside = {"dp", "dp-scp", "conic"}
    assert set(METHODS) == inside | QUICK.keys() | DEAR.keys()
    assert {name for name, one in METHODS.items() if one.inside} == inside
    instances = suite()
    for name, one in METHODS.items():
        assert any(not one.unsuited(instance) for instance in instances.values()), name
    assert METHODS["dp"].unsuited(instances["gait-time-d16-v2"]) == "takes posture, not gait"
    assert METHODS["conic"].unsuited(instances["gait-friction-d32-v2"]) == (
        "takes convex problems only"
    )
    assert METHODS["cma"].unsuited(instances["goals-gait-time-energy-d32-v2"]) == "takes one goal"


def test_a_function_of_a_module_in_the_working_directory_is_a_method(tmp_path, monkeypatch):
    (tmp_path / "own_search.py").write_text("def search(objective, seed):\n    objective.middle\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    (own,) = methods_of(["own_search:search"])
    assert (own.name, own.function.__module__) == ("own_search:search", "own_search")
    for given in ("own_search:nothing", "no_module:search"):
        with pytest.raises(ValueError, match=f"{given}: .*; accepted: MODULE:FUNCTION"):
            methods_of([given])
