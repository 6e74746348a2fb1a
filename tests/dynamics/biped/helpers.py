"""Robots, walks and comparisons shared by the tests; compiled once and used by many.

Call these inside a test: the precision is the one in force there.
"""

from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context

from stickslip.dynamics import Scene, biped

FINE = biped.Table(64, 9)
"""A table as good as the exact functions in float64 (1e-13), and cheap to compile."""

REST = dict.fromkeys(("phase", "crank_rate", "foot_position", "foot_velocity", "time"), 0.0)
REST["phase"] = np.pi / 2

PAGE = 2048

RECORDING = biped.RK4Split(record_events=True)


@lru_cache
def default_params(dtype: str = "float64") -> biped.BipedParams:
    with eval_context():  # kept beyond a trace that may ask for them first
        return biped.BipedParams.from_bars(dtype=jnp.dtype(dtype))


@lru_cache
def default_model(fidelity: str | biped.Table = FINE, dtype: str = "float64") -> biped.BipedModel:
    with eval_context():
        return model_of(default_params(dtype), fidelity)


def model_of(params: biped.BipedParams, fidelity: str | biped.Table = FINE) -> biped.BipedModel:
    return biped.prepare(params, fidelity=fidelity)


def state_of(dtype: str = "float64", **values: float) -> biped.BipedState:
    """A state of arrays, so that every walk shares the compiled functions."""
    fields = {name: jnp.asarray(values.get(name, value), dtype) for name, value in REST.items()}
    return biped.BipedState(**fields, steps=jnp.asarray(values.get("steps", 0), jnp.int32))


def start_of(case: dict[str, Any]) -> biped.BipedState:
    """The initial state of one of the reference file's trajectories."""
    return state_of(
        phase=case["theta0"], crank_rate=case["omega0"], foot_velocity=case["slide_velocity0"]
    )


def floor_of(case: dict[str, Any]) -> Scene:
    return Scene.uniform(jnp.asarray(case["mu_static"]), jnp.asarray(case["mu_kinetic"]))


def walk(
    case: dict[str, Any], count: int, *, fidelity: str | biped.Table = FINE, **options
) -> biped.Trajectory:
    """One of the reference trajectories in `count` steps, events recorded."""
    duration = case["t_end"]
    torque = jnp.full(count, case["torque"])
    options = {"integrator": RECORDING} | options
    model = default_model(fidelity)
    scene, state = floor_of(case), start_of(case)
    return biped.simulate(model, scene, state, torque, duration, duration / count, **options)


@jax.jit
def last_state(model, scene, state, torque, duration, count) -> biped.BipedState:
    """The state after `count` equal steps; compiled once for every count."""
    size = duration / count.astype(duration.dtype)
    state = jax.tree.map(lambda leaf: jnp.asarray(leaf, size.dtype), state)
    state = biped.BipedState(**(vars(state) | {"steps": jnp.zeros((), jnp.int32)}))
    return jax.lax.fori_loop(
        0, count, lambda _, now: biped.step(model, scene, now, torque, size)[0], state
    )


def outcome(state: biped.BipedState) -> jax.Array:
    """What a walk came to, as one vector."""
    return jnp.stack(
        [
            state.crank_angle,
            state.crank_rate,
            jnp.asarray(state.foot_position),
            state.foot_velocity,
        ],
        axis=-1,
    )


def exact_along(params: biped.BipedParams, at) -> tuple[biped.ReducedInertia, biped.GroundMoment]:
    """The exact functions at many crank angles, as NumPy arrays; one compilation for any number."""
    angles = np.asarray(at, float).ravel()
    padded = np.full(-(-angles.size // PAGE) * PAGE, np.pi)
    padded[: angles.size] = angles
    pages = [_exact_page(params, jnp.asarray(page)) for page in padded.reshape(-1, PAGE)]
    join = lambda *parts: np.concatenate([np.asarray(p) for p in parts])[: angles.size]  # noqa: E731
    return jax.tree.map(join, *pages)


@jax.jit
def _exact_page(params, angles):
    return jax.vmap(
        lambda angle: (biped.reduced_inertia(params, angle), biped.ground_moment(params, angle))
    )(angles)


def inertia_along(params: biped.BipedParams, angles) -> biped.ReducedInertia:
    """The exact M, P, Y and slopes at many crank angles."""
    return exact_along(params, angles)[0]


@jax.jit
def forward(model_or_params, *state):
    return biped.forward_dynamics(model_or_params, *state)


@jax.jit
def inverse(params, *motion):
    return biped.inverse_dynamics(params, *motion)
