"""UGV tasks and drives shared by the tests. Call these inside a test: its precision holds."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import stickslip  # noqa: F401  (registers the environments)
from stickslip.dynamics.ugv import PoseSolver, Track
from stickslip.envs import GymEnv, RandomTrack, UGVEnv, UGVEnvParams, UGVRandomisation
from tests.envs.helpers import Rollout, lone_walk, single_env

UGV = "stickslip/UGV-v0"
QUICK = PoseSolver(iterations=4, samples=4)
"""Compiles in a third of the time; enough for gentle ground."""
LENGTH = 64
"""Steps of a drive that are compiled for."""
RANGES = UGVRandomisation(
    track=RandomTrack(
        bump_height=(0.0, 0.2),
        bump_centre=(2.5, 3.0),
        roughness=(1e-5, 1e-3),
        waves=8,
        pieces=32,
        cells=8,
    ),
    friction=(0.005, 0.2),
    start_angles=(1.0, 2.0),
)


def options(name: str) -> dict[str, Any]:
    """Keyword arguments of gymnasium.make for the tasks of the tests."""
    if name == "random":  # everything drawn, short episodes, slips among them
        track = Track.flat(end=3.5)
        return {"randomisation": RANGES, "track": track, "preview_noise": 0.01, "preview": 3}
    if name == "short":
        return {"track": Track.bump(centre=2.5, end=3.5)}
    return {}


@lru_cache
def task(
    name: str = "short", dtype: str = "float32", autoreset: str = "disabled", **static: Any
) -> tuple[UGVEnv, UGVEnvParams]:
    """The functional environment and its parameters."""
    given = options(name)
    static = {"solver": QUICK, "preview": given.pop("preview", 4)} | static
    env = UGVEnv(autoreset=autoreset, **static)
    return env, env.make_params(dtype=jnp.dtype(dtype), **given)


def make(name: str = "random", **more: Any) -> GymEnv:
    """The Gymnasium environment without wrappers."""
    return single_env(UGV, {"solver": QUICK} | options(name) | more)


def actions(steps: int, seed: int = 0, scale: float = 1.0) -> np.ndarray:
    """Uniform random actions [steps, 2]."""
    return np.random.default_rng(seed).uniform(-scale, scale, (steps, 2)).astype(np.float32)


def drive(env: UGVEnv, params: UGVEnvParams, given: Any, seed: int = 0) -> Rollout:
    """One vehicle's steps from a seed on, with the chain of keys of every adapter: [steps, ...].

    It goes on to the next multiple of LENGTH, so that drives of many lengths share a program.
    """
    steps = len(given)
    whole = np.zeros((-(-steps // LENGTH) * LENGTH, 2), jnp.result_type(params.start))
    whole[:steps] = given
    run = jax.tree.map(np.asarray, lone_walk(env, params, jax.random.key(seed), whole))
    first = run.first_obs, run.first_state
    return Rollout(*first, *jax.tree.map(lambda of: of[:steps], run[len(first) :]))


def path_of(run: Rollout) -> np.ndarray:
    """The decision vector of a drive: the legs' angles at every station, the first included."""
    angles = np.concatenate([run.first_state.leg_angles[None], run.state.leg_angles])
    return angles.astype(float).reshape(-1)
