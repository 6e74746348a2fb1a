"""Vehicles, tracks and compiled functions shared by the UGV's tests."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import Pose, PoseSolver, Track, UGVParams, balance, place
from stickslip.dynamics.ugv.wheel import cross

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


@partial(jax.jit, static_argnums=5)
def balanced(params, track, x, angles, friction=0.8, solver=NEWTON):
    return balance(params, place(params, track, x, angles, solver), friction)


def drawn(params: UGVParams, dtype, count=64, low=2.0, high=7.5, seed=0):
    """Random front contacts [count] and leg angles [count, 2] in the range."""
    random = np.random.default_rng(seed)
    angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (count, 2))
    x = random.uniform(low, high, count)
    return jnp.asarray(x, dtype), jnp.asarray(angles, dtype)


@jax.jit
def chapter(params, pose):
    """Eqs. (40)-(42) as rows [..., 9, 9] and right sides [..., 9].

    Unknowns: F_r, N_r, F_f, N_f, F_lw (x, y; rear leg on rear wheel), F_wl (x, y; front wheel on
    front leg), M. The last three rows are those of the whole vehicle. Rolling resistance is a
    moment of each normal force, anticlockwise.
    """
    g, wheel = params.gravity, params.wheel_mass
    c = params.rolling_resistance
    arm = 0.0 if c is None else c * params.wheel_radius
    rear, front = pose.rear, pose.front
    tr, nr, tf, nf = rear.tangent, rear.normal, front.tangent, front.normal
    zero, one = jnp.zeros_like(pose.wheelbase), jnp.ones_like(pose.wheelbase)
    carried = wheel + 2 * params.leg_mass + params.body_mass
    legs = params.leg_mass * (pose.rear_leg + pose.front_leg)
    moment = wheel * rear.centre + legs + params.body_mass * pose.body
    C2, C3 = moment / carried, (moment + wheel * front.centre) / (carried + wheel)
    T2, E2, T3, D3 = rear.point - C2, front.centre - C2, rear.point - C3, front.point - C3
    rows = [
        [tr[..., 0], nr[..., 0], 0, 0, 1, 0, 0, 0, 0],
        [tr[..., 1], nr[..., 1], 0, 0, 0, 1, 0, 0, 0],
        [params.wheel_radius, arm, 0, 0, 0, 0, 0, 0, 1],
        [tr[..., 0], nr[..., 0], 0, 0, 0, 0, 1, 0, 0],
        [tr[..., 1], nr[..., 1], 0, 0, 0, 0, 0, 1, 0],
        [cross(T2, tr), cross(T2, nr) + arm, 0, 0, 0, 0, -E2[..., 1], E2[..., 0], -1],
        [tr[..., 0], nr[..., 0], tf[..., 0], nf[..., 0], 0, 0, 0, 0, 0],
        [tr[..., 1], nr[..., 1], tf[..., 1], nf[..., 1], 0, 0, 0, 0, 0],
        [cross(T3, tr), cross(T3, nr) + arm, cross(D3, tf), cross(D3, nf) + arm, 0, 0, 0, 0, 0],
    ]
    right = [0, wheel * g, 0, 0, carried * g, 0, 0, (carried + wheel) * g, 0]
    matrix = jnp.stack([jnp.stack([of * one for of in row], -1) for row in rows], -2)
    return matrix, jnp.stack([zero + of for of in right], -1)


def mirrored(track: Track, about: float) -> Track:
    """The same ground driven from the other side; concrete and float64."""
    return Track.from_function(lambda x: track.height(2 * about - x))
