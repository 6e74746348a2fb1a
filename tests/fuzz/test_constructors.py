"""Every public constructor against a list of bad values: each is refused by name, or legitimate.

Run with -s for the counts that docs/reliability.md quotes.
"""

from __future__ import annotations

import inspect
from typing import Any

import pytest

from stickslip import envs, optim
from stickslip.dynamics import biped, ugv
from tests.fuzz.constructors import plans
from tests.fuzz.environments import HAS_SB3
from tests.fuzz.values import BAD, Plan

QUICK = (
    "Scene.uniform", "BipedState", "Uniform", "EventExact", "Table", "UGVParams", "BipedEnv",
    "step", "GymVectorEnv", "UGVEnvParams.replace", "PostureProblem.along",
)  # fmt: skip

NO_CONSTRUCTORS = {
    # what a call returns, or a function of numbers inside a trace, whose failures are statuses
    "BipedEnvParams", "BipedEnvState", "Contact", "Events", "ForwardDynamics", "GroundMoment",
    "InverseDynamics", "Kinematics", "LegPins", "Recommendation", "ReducedInertia",
    "Setting", "Trajectory", "UGVEnvParams", "UGVEnvState", "Equilibrium", "Forces", "Pose",
    "Result", "PostureResult", "DriveBound", "Evaluation", "Station", "OptimStatus",
    "FunctionalEnv", "exchange_mismatch",
    "floor_position", "forward_dynamics", "ground_moment", "inverse_dynamics", "kinematics",
    "reduced_inertia", "step_length", "balance", "ground_forces", "leg_torques",
    "place", "wheel_turns", "station", "Odometer", "Collected", "WheelContact",
    # no arguments, or checked by tests of their own
    "Joint", "Reduced", "Criterion", "Weighted", "criterion_by_name", "solve",
    "recommend", "equilibrium", "pose", "check_walk", "WalkCheck", "own_time", "collect",
    "check_poses", "SettingCheck", "FreeProblem", "Problem", "Method", "Structure", "methods_of",
    "Certificate", "Gait", "GaitResult", "Replay", "replay", "TaskDefinition", "known_of",
    "task_by_name", "bound_every_drive", "BudgetSpent", "FunctionProblem", "Instance", "Objective",
    "Record", "instance", "suite",
}  # fmt: skip


def outcome(plan: Plan, argument: str, what: str) -> str:
    """'refused', 'accepted', or what is wrong."""
    said = plan.says.get(argument, argument)
    try:
        plan.call(**{**plan.base, argument: BAD[what]})
    except ValueError as error:
        text = str(error)
        if what in plan.accepts[argument] or said in text:
            return "refused" if len(text) < 1500 else f"a message of {len(text)} characters"
        return f"no {said!r} in: {text[:120]}"
    except BaseException as error:  # noqa: BLE001, anything else is what is looked for
        return f"{type(error).__name__}: {str(error)[:120]}"
    return "accepted" if what in plan.accepts[argument] else "accepted wrongly"


def attack(names: Any) -> tuple[dict[str, int], list[str]]:
    counts, wrong = {"refused": 0, "accepted": 0}, []
    for name, plan in names.items():
        for argument in plan.accepts:
            for what in set(BAD) - set(plan.skips):
                came = outcome(plan, argument, what)
                if came in counts:
                    counts[came] += 1
                else:
                    wrong.append(f"{name}({argument} = {what}): {came}")
                    print(wrong[-1], flush=True)
        print(f"{name}: {counts}", flush=True)
    return counts, wrong


def test_bad_values_of_some_constructors_are_refused_by_name():
    chosen = {name: plan for name, plan in plans().items() if name in QUICK}
    counts, wrong = attack(chosen)
    assert not wrong, "\n".join(wrong)
    assert counts["refused"] > 500


@pytest.mark.long
def test_bad_values_of_every_constructor_are_refused_by_name():
    counts, wrong = attack(plans())
    total = sum(counts.values()) + len(wrong)
    print(f"\nconstructors: {len(plans())} calls, every argument, {total} values: {counts}")
    assert not wrong, f"{len(wrong)}\n" + "\n".join(wrong)


def test_no_argument_of_a_constructor_is_forgotten():
    for name, plan in plans().items():
        given = inspect.signature(plan.of or plan.call).parameters.values()
        named = {one.name for one in given if one.kind is not one.VAR_KEYWORD}
        assert named <= set(plan.accepts), (name, named - set(plan.accepts))


def test_no_public_constructor_is_forgotten():
    known = {name.split(".")[0] for name in plans()}
    for package in (biped, ugv, envs, optim):
        there = {name for name in package.__all__ if not name.startswith("SB3") or HAS_SB3}
        public = {name for name in there if callable(getattr(package, name))}
        assert not public - known - NO_CONSTRUCTORS, public - known - NO_CONSTRUCTORS
