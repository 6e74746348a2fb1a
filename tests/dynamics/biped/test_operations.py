"""A scene does not pay for what it leaves out: sizes and contents of the compiled programs."""

import json
import re
from functools import lru_cache

import jax
import pytest

from benchmarks import operations
from stickslip.dynamics import Scene

NUMBERS = {"uniform": {"mu_static", "mu_kinetic"}, "patches": {"edges", "mu_static", "mu_kinetic"}}
NUMBERS |= {"smoothed": {"mu_kinetic", "slip_speed"}, "grip": set()}
"""The floors' numbers, which the program names among its inputs."""

FEATURES = {
    # what a feature calls, by the names that XLA keeps beside each of its instructions
    "ground moment": {"moment_at"},
    "joint forces": {"joint_forces", "unit_solutions"},
    "friction cone": {"cone_margin", "mode_of"},
    "sliding": {"moving"},
    "patches": {"edge_ahead", "patch_at"},
    "smoothing": {"smoothed_direction"},
    "fixed steps": {"_classical_stages"},
    "adaptive steps": {"dormand_prince_step"},
    "event location": {"first_crossing"},
    "given motion": {"prescribed"},
    "table": {"_evaluate"},
    "linkage": {"kinematics"},
}

PROGRAMS = {
    # name: the features that are in its program; the others are not
    "grip": {"ground moment", "fixed steps", "event location", "table"},
    "grip, state only": {"fixed steps", "event location", "table"},
    "uniform": {
        *("ground moment", "friction cone", "sliding", "fixed steps"),
        *("event location", "table"),
    },
    "uniform, euler": {"ground moment", "friction cone", "sliding", "table"},
    "uniform, event_exact": {
        *("ground moment", "friction cone", "sliding", "adaptive steps"),
        *("event location", "table"),
    },
    "uniform, crank motion given": {
        *("ground moment", "friction cone", "given motion", "fixed steps"),
        *("event location", "table"),
    },
    "uniform, joint forces": {
        *("ground moment", "joint forces", "friction cone", "sliding", "fixed steps"),
        *("event location", "table", "linkage"),
    },
    "patches": {
        *("ground moment", "friction cone", "sliding", "patches", "fixed steps"),
        *("event location", "table"),
    },
    "smoothed": {
        *("ground moment", "sliding", "smoothing", "fixed steps"),
        *("event location", "table"),
    },
}


QUICK = ("grip", "uniform", "patches", "smoothed")
each_program = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.long] * (name not in QUICK)) for name in PROGRAMS],
)
"""One for each floor; every other program takes seconds to compile."""


@lru_cache
def program(name: str):
    """Compiled in whatever precision the first test asks for: sizes are compared, not values."""
    return operations.compiled_walk(operations.cases()[name])


def size(name: str) -> int:
    return operations.count(program(name))["computing"]


def rows_of(text: str, table: str) -> dict[int, str]:
    """One of the numbered tables at the head of a program's text."""
    body = re.search(rf"^{table}\n((?:\d+ .*\n)+)", text, re.MULTILINE)
    assert body, table
    pairs = (line.split(" ", 1) for line in body[1].splitlines())
    return {int(number): rest for number, rest in pairs}


@lru_cache
def functions(name: str) -> frozenset[str]:
    """Functions that at least one instruction of the optimised program comes from."""
    text = program(name).as_text()
    if jax.__version_info__ < (0, 10) and "FunctionNames" not in text:
        pytest.skip("XLA of this JAX does not say which functions its instructions come from")
    names = {k: v.strip('"') for k, v in rows_of(text, "FunctionNames").items()}
    places = rows_of(text, "FileLocations")
    frames = rows_of(text, "StackFrames")

    def field(row: str, key: str) -> int:
        found = re.search(rf"{key}=(\d+)", row)
        return int(found[1]) if found else 0

    met, left = set(), set(map(int, re.findall(r"stack_frame_id=(\d+)", text)))
    while left - {0}:
        met |= left
        left = {field(frames[one], "parent_frame_id") for one in left if one in frames} - met
    located = {field(frames[one], "file_location_id") for one in met if one in frames}
    called = {field(places[one], "function_name_id") for one in located}
    return frozenset(names[one].rsplit(".", 1)[-1] for one in called)


@each_program
def test_a_program_holds_the_features_of_its_scene_and_no_other(name):
    found = functions(name)
    for feature, calls in FEATURES.items():
        if feature in PROGRAMS[name]:
            assert calls & found, feature
        else:
            assert not calls & found, (feature, calls & found)


@each_program
def test_only_smoothed_friction_compiles_a_hyperbolic_tangent(name):
    kinds = operations.count(program(name))["kinds"]
    assert ("tanh" in kinds) == (name == "smoothed")


@each_program
def test_a_program_reads_the_numbers_of_its_floor_and_no_other(name):
    text = program(name).as_text()
    floor = name.split(",")[0]
    found = {word for word in set.union(*NUMBERS.values()) if f"floor.{word}" in text}
    assert found == NUMBERS[floor]


@each_program
def test_no_program_solves_the_full_system_for_what_two_equations_say(name):
    """Not even joint forces take a matrix of 33 or more unknowns apart: no LU, no library call."""
    kinds = operations.count(program(name))["kinds"]
    assert not kinds.keys() & {"custom-call", "triangular-solve", "cholesky"}


def test_grip_takes_less_than_two_thirds_of_the_operations_of_a_floor_that_slips():
    assert size("grip") < 0.667 * size("uniform")
    assert size("grip") < 0.6 * size("patches")
    flops = [operations.count(program(name))["flops"] for name in ("grip", "uniform")]
    assert flops[0] < 0.667 * flops[1]


def test_smoothed_friction_takes_fewer_operations_than_switching():
    assert size("grip") < size("smoothed") < 0.8 * size("uniform")


@pytest.mark.long
def test_leaving_out_the_forces_takes_operations_out():
    assert size("grip, state only") < size("grip")


@pytest.mark.long
def test_joint_forces_cost_only_where_they_are_asked_for():
    assert size("uniform, joint forces") > 1.3 * size("uniform")


def test_edges_cost_only_where_there_are_edges():
    assert size("uniform") < size("patches")


def test_grip_has_no_friction_among_its_numbers():
    assert jax.tree.leaves(Scene.grip()) == []
    assert jax.tree.leaves(Scene.grip(steps="one", outputs="state")) == []
    assert len(jax.tree.leaves(Scene.uniform(0.1))) == 2
    assert len(jax.tree.leaves(Scene.smoothed(0.1))) == 2


def test_every_integrator_and_fidelity_has_a_row():
    every = operations.cases().values()
    assert {case.integrator for case in every} == set(operations.INTEGRATORS)
    assert {case.fidelity for case in every} == set(operations.FIDELITIES)
    assert {case.scene.outputs for case in every} == {"forces", "state", "joints"}


def test_the_benchmark_writes_what_it_prints(tmp_path, monkeypatch, capsys):
    few = {name: operations.cases()[name] for name in ("grip", "uniform")}
    programs = {id(case): program(name) for name, case in few.items()}
    monkeypatch.setattr(operations, "cases", lambda: few)
    monkeypatch.setattr(operations, "compiled_walk", lambda case: programs[id(case)])
    path = tmp_path / "deep" / "operations.json"
    operations.main(["--out", str(path)])
    content = json.loads(path.read_text(encoding="utf-8"))
    assert {"machine", "versions", "commit", "rows"} <= set(content)
    assert [row["scene"] for row in content["rows"]] == ["grip", "uniform"]
    printed = capsys.readouterr().out
    for row in content["rows"]:
        assert f"| {row['instructions']:12d} |" in printed
        assert sum(row["kinds"].values()) == row["instructions"]
