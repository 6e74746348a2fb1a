"""Vehicles, tracks and compiled functions shared by the UGV's tests."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import Pose, PoseSolver, Track, UGVParams, balance, place
from stickslip.dynamics.ugv.statics import five, nine

NEWTON = PoseSolver()
SCAN = PoseSolver("scan")

TRACKS: dict[str, Any] = {
    "flat": Track.flat,
    "slope": partial(Track.incline, 0.3),
    "bump": Track.bump,
    "sinusoid": Track.sinusoid,
    "step": Track.step,
    "ditch": Track.ditch,
}


@partial(jax.jit, static_argnums=4)
def placed(params, track, x, angles, solver=NEWTON) -> Pose:
    return place(params, track, x, angles, solver)


@partial(jax.jit, static_argnums=(5, 6))
def balanced(params, track, x, angles, friction=0.8, system="closed", solver=NEWTON):
    return balance(params, place(params, track, x, angles, solver), friction, system)


def drawn(params: UGVParams, dtype, count=64, low=2.0, high=7.5, seed=0):
    """Random front contacts [count] and leg angles [count, 2] in the range."""
    random = np.random.default_rng(seed)
    angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (count, 2))
    x = random.uniform(low, high, count)
    return jnp.asarray(x, dtype), jnp.asarray(angles, dtype)


@jax.jit
def rows_of(params, pose):
    return five(params, pose), nine(params, pose)


def mirrored(track: Track, about: float) -> Track:
    """The same ground driven from the other side; concrete and float64."""
    return Track.from_function(lambda x: track.height(2 * about - x))
