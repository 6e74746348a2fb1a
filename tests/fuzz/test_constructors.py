"""Every public constructor against bad values: each argument refuses them with a ValueError."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from stickslip import envs, optim
from stickslip.dynamics import Grip, Patches, Scene, Uniform, biped, ugv
from stickslip.dynamics.biped.simulation import require_kinds
from tests.extras import MISSING

HAS_SB3 = "stable_baselines3" not in MISSING
BAD: dict[str, Any] = {
    "huge": 10**400,
    "minus huge": -(10**400),
    "nan": np.nan,
    "inf": np.inf,
    "bytes": b"1",
    "complex": 1j,
    "empty list": [],
    "list of none": [None],
    "ragged": [[1.0], [1.0, 2.0]],
    "dict": {},
    "object": object(),
    "function": lambda: 1.0,
    "array of text": np.asarray(["a"]),
    "array of objects": np.asarray([None]),
    "date": np.datetime64("2020-01-01"),
}
"""No argument accepts one of these, but for those named in Plan.takes."""
SCENE = ("payload", "steps", "outputs")
"""Options of Scene's constructors."""


class Plan(NamedTuple):
    """A call, its other arguments, and arguments that its signature does not name.

    of: the function with the signature, where `call` is a lambda. takes: values of BAD that are
    legitimate, or marked by a status.
    """

    call: Callable[..., Any]
    base: dict[str, Any] = {}  # noqa: RUF012
    more: tuple[str, ...] = ()
    of: Callable[..., Any] | None = None
    takes: tuple[str, ...] = ()

    def arguments(self) -> list[str]:
        given = inspect.signature(self.of or self.call).parameters.values()
        return [one.name for one in given if one.kind is not one.VAR_KEYWORD] + list(self.more)


def at_boundary(**parts: Any) -> None:
    """Check a scene or a state as the next call does."""
    state = parts.get("state", biped.BipedState())
    require_kinds(biped.BipedParams.from_bars(), parts.get("scene", Scene.grip()), state)
    state.validate()


def floor(kind: type) -> Callable[..., None]:
    return lambda **given: at_boundary(scene=Scene(kind(**given)))


def fields_of(value: Any) -> tuple[str, ...]:
    return tuple(type(value).__dataclass_fields__)


def quick_plans() -> dict[str, Plan]:
    """Constructors that compile little."""
    walker, driver = envs.BipedEnv().make_params(), envs.UGVEnv().make_params()
    along = {"params": ugv.UGVParams(), "track": ugv.Track.bump(), "spacing": 0.5}
    return {
        "Scene.uniform": Plan(Scene.uniform, {"mu_static": 0.5}, SCENE),
        "BipedState": Plan(
            lambda **k: at_boundary(state=biped.BipedState(**k)), of=biped.BipedState
        ),
        "Uniform": Plan(floor(Uniform), {"mu_static": 1.0, "mu_kinetic": 0.5}, of=Uniform),
        "EventExact": Plan(biped.EventExact),
        "Table": Plan(biped.Table),
        "UGVParams": Plan(ugv.UGVParams),
        "BipedEnv": Plan(envs.BipedEnv),
        "GymVectorEnv": Plan(
            lambda **k: envs.GymVectorEnv(**{"params": walker, **k}),
            {"env": envs.BipedEnv(), "num_envs": 1},
            of=envs.GymVectorEnv,
        ),
        "UGVEnvParams.replace": Plan(lambda **k: driver.replace(**k), {}, fields_of(driver)),
        "PostureProblem.along": Plan(optim.PostureProblem.along, along),
    }


def long_plans() -> dict[str, Plan]:
    """The other constructors, steps and walks."""
    bare, walker = biped.BipedParams.from_bars(), envs.BipedEnv().make_params()
    model = biped.prepare(bare)
    state = {"scene": Scene.grip(), "state": biped.BipedState(), "dt": 0.5}
    marked = ("nan", "inf")
    inverse = state | {"params": model, "duration": 0.5, "crank_acceleration": 0.0}
    edges = {"edges": np.asarray([0.1]), "mu_static": np.ones(2), "mu_kinetic": np.ones(2)}
    track, flat = {"x": [0.0, 1.0], "y": [0.0, 0.0]}, ugv.Track.flat()
    placed = {"params": ugv.UGVParams(), "track": flat, "x_front": 4.0, "leg_angles": [1.5, 1.5]}
    found = {
        "Scene.grip": Plan(Scene.grip, {}, SCENE),
        "Scene.patches": Plan(Scene.patches, {"edges": [0.1], "mu_static": [0.5, 0.5]}, SCENE),
        "Scene": Plan(lambda **k: at_boundary(scene=Scene(**k)), {"floor": Grip()}, of=Scene),
        "Patches": Plan(floor(Patches), edges, of=Patches),
        "BipedParams.from_bars": Plan(biped.BipedParams.from_bars),
        "BipedParams.replace": Plan(lambda **k: bare.replace(**k), {}, fields_of(bare)),
        "prepare": Plan(biped.prepare, {"params": bare}),
        "BipedModel": Plan(biped.BipedModel, {"bare": bare}),
        "step": Plan(biped.step, state | {"params": model, "torque": 0.5}, takes=marked),
        "simulate": Plan(
            biped.simulate,
            state | {"params": model, "torque": 0.5, "duration": 0.5},
            takes=("function", *marked),
        ),
        "simulate_inverse": Plan(biped.simulate_inverse, inverse, takes=("function", *marked)),
        "Chebyshev": Plan(biped.Chebyshev),
        "Paper": Plan(biped.Paper),
        "RK4Split": Plan(biped.RK4Split),
        "UGVParams.replace": Plan(ugv.UGVParams().replace, {}, fields_of(ugv.UGVParams())),
        **{
            name: Plan(make, {}, () if name == "rough" else fields_of(make().shape))
            for name in ugv.TRACKS
            if (make := getattr(ugv.Track, name))
        },
        "Track.resampled": Plan(flat.resampled, {"start": 0.0, "end": 1.0, "pieces": 4}),
        "Odometer.along": Plan(ugv.Odometer.along, {"track": flat}),
        "pose": Plan(ugv.pose, placed),
        "equilibrium": Plan(ugv.equilibrium, placed),
        "Track.from_points": Plan(ugv.Track.from_points, track),
        "Surface.patches": Plan(ugv.Surface.patches, {"edges": [1.0], "factors": [1.0, 0.5]}),
        "PoseSolver": Plan(ugv.PoseSolver),
        "UGVEnv": Plan(envs.UGVEnv),
        "BipedEnv.make_params": Plan(envs.BipedEnv().make_params),
        "UGVEnv.make_params": Plan(envs.UGVEnv().make_params),
        "BipedEnvParams.replace": Plan(lambda **k: walker.replace(**k), {}, fields_of(walker)),
        "GaitProblem.periodic": Plan(optim.GaitProblem.periodic, {"params": bare}),
        "GaitProblem.transfer": Plan(
            optim.GaitProblem.transfer, {"params": bare, "steps_taken": 1}
        ),
    }
    if HAS_SB3:
        found["SB3VecEnv"] = Plan(
            lambda **k: envs.SB3VecEnv(**{"params": walker, **k}),
            {"env": envs.BipedEnv(autoreset="same_step"), "num_envs": 1},
            of=envs.SB3VecEnv,
        )
    return found


def fault(plan: Plan, argument: str, value: Any) -> str:
    """How a call fails to refuse a bad value by the argument's name, or nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            plan.call(**{**plan.base, argument: value})
    except ValueError as error:
        text = str(error)
        return "" if argument in text and len(text) < 1500 else f"says: {text[:120]}"
    except BaseException as error:  # noqa: BLE001, anything else is what is looked for
        return f"{type(error).__name__}: {str(error)[:120]}"
    return "accepted"


@pytest.mark.parametrize("plans", [quick_plans, pytest.param(long_plans, marks=pytest.mark.long)])
def test_bad_values_of_constructors_are_refused_by_name(plans):
    faults, tried = [], 0
    for name, plan in plans().items():
        for argument in plan.arguments():
            for what in BAD.keys() - set(plan.takes):
                tried += 1
                if found := fault(plan, argument, BAD[what]):
                    faults.append(f"{name}({argument} = {what}): {found}")
    print(f"\n{tried} values in arguments of constructors")
    assert not faults, "\n".join(faults)
