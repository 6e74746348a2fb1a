"""A scene does not pay for what it leaves out: sizes and contents of the compiled programs."""

import json
from functools import lru_cache

import jax
import pytest

from benchmarks import operations
from stickslip.dynamics import Scene

SLIP = ("mu_static", "mu_kinetic")
EDGES = ("edges",)
FORCES = ("moment_at",)
"""Names of the numbers and functions that a feature uses, which XLA keeps in its program."""


@lru_cache
def program(name: str):
    """Compiled in whatever precision the first test asks for: sizes are compared, not values."""
    return operations.compiled_step(operations.scenes()[name])


def size(name: str) -> int:
    return operations.count(program(name))["computing"]


def test_grip_takes_less_than_half_the_operations_of_a_floor_that_slips():
    assert size("grip") < 0.5 * size("uniform")
    assert size("grip") < 0.45 * size("patches")
    flops = [operations.count(program(name))["flops"] for name in ("grip", "uniform")]
    assert flops[0] < 0.5 * flops[1]


def test_leaving_out_the_forces_takes_operations_out():
    assert size("grip, state only") < size("grip")


def test_one_step_costs_no_more_than_walking_on():
    assert size("grip, one step") <= size("grip")


def test_edges_cost_only_where_there_are_edges():
    assert size("uniform") < size("patches")


@pytest.mark.parametrize(
    ("name", "present", "absent"),
    [
        ("grip", FORCES, (*SLIP, *EDGES)),
        ("grip, state only", (), (*SLIP, *EDGES, *FORCES)),
        ("uniform", (*FORCES, *SLIP), EDGES),
        ("patches", (*FORCES, *SLIP, *EDGES), ()),
    ],
)
def test_features_that_are_off_leave_no_trace_in_the_program(name, present, absent):
    text = program(name).as_text()
    for word in present:
        assert word in text, word
    for word in absent:
        assert word not in text, word


def test_grip_has_no_friction_among_its_numbers():
    assert jax.tree.leaves(Scene.grip()) == []
    assert jax.tree.leaves(Scene.grip(steps="one", outputs="state")) == []
    assert len(jax.tree.leaves(Scene.uniform(0.1))) == 2


def test_the_benchmark_writes_what_it_prints(tmp_path, monkeypatch, capsys):
    few = {name: operations.scenes()[name] for name in ("grip", "uniform")}
    monkeypatch.setattr(operations, "scenes", lambda: few)
    monkeypatch.setattr(operations, "compiled_step", lambda scene: program(names[id(scene)]))
    names = {id(scene): name for name, scene in few.items()}
    path = tmp_path / "deep" / "operations.json"
    operations.main(["--out", str(path)])
    content = json.loads(path.read_text(encoding="utf-8"))
    assert {"machine", "versions", "commit", "rows"} <= set(content)
    assert [row["scene"] for row in content["rows"]] == ["grip", "uniform"]
    printed = capsys.readouterr().out
    for row in content["rows"]:
        assert f"| {row['instructions']:12d} |" in printed
        assert sum(row["kinds"].values()) == row["instructions"]
    assert [p.name for p in path.parent.iterdir()] == ["operations.json"]
