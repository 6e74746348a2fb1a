"""What is called with numbers of a biped, its floor and its walks."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from stickslip.dynamics import Grip, Patches, Scene, Smoothed, Status, Uniform, biped
from stickslip.dynamics.biped.simulation import require_kinds
from tests.fuzz.values import (
    ABOVE,
    ANY_ONE,
    BATCHES,
    CHOICE,
    FLAG,
    HAND,
    INTEGER,
    KIND,
    NOT_BELOW,
    ONE,
    REAL,
    Plan,
    maybe,
)

OPTIONS = {"payload": maybe(*NOT_BELOW), "steps": CHOICE, "outputs": CHOICE}
BARS = dict.fromkeys(
    ("crank_length", "gravity", "ground_link", "rod", "rod_pin", "rocker", "tendon_drop",
     "upper_tendon", "lower_tendon", "femur", "femur_pin", "tibia", "tibia_pin", "stabiliser"),
    ABOVE,
) | dict.fromkeys(
    ("bar_density", "hip_mass", "foot_mass", "foot_inertia", "offset", "payload", "heel", "toe",
     "slot_depth", "hip_span"),
    NOT_BELOW,
) | {"hip_centre": ("pair",), "dtype": ("none", "type")}  # fmt: skip
STATE = dict.fromkeys(("crank_rate", "foot_position", "foot_velocity", "time"), REAL)
STATE |= {"phase": (), "steps": ("minus one", "pair", "other shape")}
STEP = {"params": KIND, "scene": KIND, "state": KIND, "torque": ANY_ONE, "dt": ("half",)}
MARKED = ("nan", "inf", "-inf", "overflow")
"""What a step marks by its status, traced or not."""
HOW = {"fidelity": CHOICE, "integrator": CHOICE}
SOUND_STEP = {"scene": Scene.grip(), "state": biped.BipedState(), "torque": 0.5, "dt": 0.5}


@lru_cache
def model() -> biped.BipedModel:
    return biped.prepare(biped.BipedParams.from_bars())


@lru_cache
def bare() -> biped.BipedParams:
    return biped.BipedParams.from_bars()


def at_boundary(**parts: Any) -> None:
    """What the next call makes of a scene or a state that was put together by hand."""
    state = parts.get("state", biped.BipedState())
    require_kinds(bare(), parts.get("scene", Scene.grip()), state)
    state.validate()


def with_model(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda **given: function(**{"params": model(), **given})


def one_step(**given: Any) -> None:
    """A step; a torque that is no number in single precision must come out marked. NumPy warns of
    one that is a number in double precision only."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        _, contact = biped.step(**{"params": model(), **given})
    sound = abs(given["torque"]) < float(np.finfo(np.float32).max)
    assert (contact.status == Status.NON_FINITE) == (not sound)


def floors() -> dict[str, Plan]:
    """Scenes, and floors by themselves."""
    grip, uniform = Scene.grip, Scene.uniform
    return {
        "Scene.grip": Plan(grip, OPTIONS),
        "Scene.uniform": Plan(
            uniform,
            OPTIONS | {"mu_static": NOT_BELOW, "mu_kinetic": maybe(*NOT_BELOW)},
            {"mu_static": 0.5},
        ),
        "Scene.smoothed": Plan(
            Scene.smoothed,
            OPTIONS | {"mu_kinetic": NOT_BELOW, "slip_speed": ABOVE},
            {"mu_kinetic": 0.5},
        ),
        "Scene.patches": Plan(
            Scene.patches,
            OPTIONS | {"edges": ("pair",), "mu_static": ("pair",), "mu_kinetic": ("none",)},
            {"edges": [0.1], "mu_static": [0.5, 0.5]},
        ),
        "Scene": Plan(
            lambda **k: at_boundary(scene=Scene(**k)), OPTIONS | {"floor": ()}, {"floor": Grip()}
        ),
        "Uniform": Plan(
            lambda **k: at_boundary(scene=Scene(Uniform(**k))),
            {"mu_static": HAND, "mu_kinetic": (*HAND, "subnormal")},
            {"mu_static": 1.0, "mu_kinetic": 0.5},
        ),
        "Smoothed": Plan(
            lambda **k: at_boundary(scene=Scene(Smoothed(**k))),
            {"mu_kinetic": (*HAND, "subnormal"), "slip_speed": HAND},
            {"mu_kinetic": 0.5, "slip_speed": 0.1},
        ),
        "Patches": Plan(
            lambda **k: at_boundary(scene=Scene(Patches(**k))),
            {"edges": (), "mu_static": (), "mu_kinetic": ()},
            {"edges": np.asarray([0.1]), "mu_static": np.ones(2), "mu_kinetic": np.ones(2)},
        ),
    }


def walkers() -> dict[str, Plan]:
    """Robots, their states, steps and walks, and what computes these."""
    step = SOUND_STEP
    return {
        "BipedParams.from_bars": Plan(biped.BipedParams.from_bars, BARS, skips=BATCHES),
        "BipedParams.replace": Plan(
            lambda **k: bare().replace(**k),
            {name: BARS.get(name, ()) for name in biped.BipedParams.__dataclass_fields__},
            skips=BATCHES,
        ),
        "BipedState": Plan(lambda **k: at_boundary(state=biped.BipedState(**k)), STATE),
        "prepare": Plan(
            biped.prepare,
            {"params": KIND, "fidelity": CHOICE, "payload": maybe(*NOT_BELOW)},
            {"params": bare()},
        ),
        "BipedModel": Plan(
            biped.BipedModel,
            {"bare": KIND, "fidelity": CHOICE, "payload": maybe(*NOT_BELOW), "load": ("none",)},
            {"bare": bare()},
        ),
        "step": Plan(one_step, STEP | HOW | {"torque": (*ANY_ONE, *MARKED)}, step, of=biped.step),
        "simulate": Plan(
            with_model(biped.simulate),
            STEP | HOW | {"duration": ONE},
            step | {"duration": 0.5},
            skips=("function", "type"),
            of=biped.simulate,
        ),
        "simulate_inverse": Plan(
            with_model(biped.simulate_inverse),
            {name: of for name, of in STEP.items() if name != "torque"}
            | HOW
            | {"crank_acceleration": ANY_ONE, "duration": ONE},
            {k: v for k, v in step.items() if k != "torque"}
            | {"duration": 0.5, "crank_acceleration": 0.0},
            skips=("function", "type"),
            of=biped.simulate_inverse,
        ),
        **{
            name: Plan(getattr(biped, name), {"substeps": INTEGER, "record_events": FLAG})
            for name in ("Euler", "SemiImplicitEuler", "RK4")
        },
        "RK4Split": Plan(
            biped.RK4Split, {"substeps": INTEGER, "max_events": INTEGER, "record_events": FLAG}
        ),
        "EventExact": Plan(
            biped.EventExact,
            {"rtol": (), "atol": (), "max_steps": INTEGER, "max_turn": ONE, "record_events": FLAG},
        ),
        "Table": Plan(biped.Table, {"pieces": INTEGER, "degree": INTEGER}),
        "Chebyshev": Plan(biped.Chebyshev, {"degree": INTEGER}),
        "Paper": Plan(biped.Paper, {"step": ONE}),
    }
