"""Errors of a setting on the user's own ground, against the default solver in float64."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import (
    require_integer,
    require_kind,
    require_memory,
    require_number,
)
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv.params import UGVParams
from stickslip.dynamics.ugv.pose_solver import NEWTON, PoseSolver, depth_allowed
from stickslip.dynamics.ugv.poses import Pose
from stickslip.dynamics.ugv.recommendation import Setting
from stickslip.dynamics.ugv.statics import Equilibrium, equilibrium
from stickslip.dynamics.ugv.track import Track, track_of
from stickslip.dynamics.ugv.wheel import penetration

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Float, Real
    from numpy.typing import ArrayLike

    from stickslip.dynamics.numeric import Lists, Number
    from stickslip.dynamics.ugv.ground.shapes import Values

UNPLACED = (
    Status.NO_SOLUTION,
    Status.NON_FINITE,
    Status.NOT_CONVERGED,
    Status.HOLLOW_GROUND,
)
"""Poses with one of these have no numbers to compare."""
UNSEEN = (Status.HOLLOW_GROUND, Status.GROUNDED)
"""Statuses that a setting without the checks cannot detect."""
POSE_BYTES = 64 * 1024
"""Working memory of a pose with its checks, about [bytes]."""


@dataclass(frozen=True)
class SettingCheck:
    """A setting on poses of one track, against the default solver in float64 on the track itself.

    torque_error: largest, over weight times wheel radius [-]; contact_error: of the rear contact,
    largest [m]. typical_torque_error, typical_contact_error: the medians. count: of the poses;
    compared: of those with numbers to compare, which both could place. wrong_statuses: poses
    whose status differs and whose errors do not explain it. unseen: poses on hollow ground, or
    with the body on the ground, of which a setting without the checks says nothing. worst: the
    pose of the largest error, (x_front [m], rear, front [rad]); None where nothing is compared.
    cost, reference_cost: processor seconds for each pose, warm, of the setting and of the default.
    Errors contain the rounding of the given numbers to the setting's precision.
    """

    setting: Setting
    torque_error: float
    contact_error: float
    typical_torque_error: float
    typical_contact_error: float
    count: int
    compared: int
    wrong_statuses: int
    unseen: int
    worst: tuple[float, float, float] | None
    cost: float
    reference_cost: float


class Differences(NamedTuple):
    """Errors of each pose [n], NaN where either has no numbers."""

    torque: np.ndarray
    """Error of the torque, over weight times wheel radius [-]."""
    contact: np.ndarray
    """Error of the rear contact, in wheel radii [-]."""
    wrong: np.ndarray
    """True if the status differs though the errors do not explain it."""
    unseen: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """The worse of both [-]."""
        return np.maximum(self.torque, self.contact)


def check_poses(
    setting: Setting,
    params: UGVParams,
    track: Track | str,
    x_front: Real[Number, "..."] | Lists | None = None,
    leg_angles: Real[Number, "... 2"] | Lists | None = None,
    *,
    friction: float = 0.8,
    count: int = 1000,
    seed: int = 0,
) -> SettingCheck:
    """Errors and cost of a setting for these poses of this vehicle on this track.

    x_front: front contacts [...] [m]; leg_angles: [..., 2] [rad]; broadcast. Where left out, they
    are drawn from the seed: `count` contacts from the track's start to its end, angles over the
    whole range. Says what holds for these poses, and nothing about others. jax_enable_x64 is
    switched on inside, whatever it is outside; not for use inside a trace. ValueError for bad
    values.
    """
    require_kind("setting", setting, Setting, "a Setting")
    require_kind("params", params, UGVParams, "UGVParams")
    track = track_of(track)
    params.validate()
    require_number("friction", friction, low=0.0, accepted="a number >= 0")
    x, angles = _poses(params, track, x_front, leg_angles, count, seed)
    with jax.enable_x64(True):
        exact, ground = _in("float64", params), track.astype("float64")
        truth, reference_cost = _timed(NEWTON, exact, ground, x, angles, friction)
        vehicle, *places = _in(setting.dtype, (params, x, angles, friction))
        answer, cost = _timed(setting.solver, vehicle, setting.prepared(track, params), *places)
        off = differences(
            exact, truth, answer, setting, partial(_entered, exact, ground, truth.pose)
        )
    compared = np.isfinite(off.error)
    torque, contact = (
        column[compared] if np.any(compared) else np.zeros(1)
        for column in (off.torque, off.contact)
    )
    radius = float(np.max(np.asarray(params.wheel_radius)))
    worst = int(np.argmax(np.where(compared, off.error, -1.0)))
    return SettingCheck(
        setting,
        torque_error=float(np.max(torque)),
        contact_error=float(np.max(contact)) * radius,
        typical_torque_error=float(np.median(torque)),
        typical_contact_error=float(np.median(contact)) * radius,
        count=len(x),
        compared=int(np.sum(compared)),
        wrong_statuses=int(np.sum(off.wrong)),
        unseen=int(np.sum(off.unseen)),
        worst=_pose(x[worst], *angles[worst]) if np.any(compared) else None,
        cost=cost / len(x),
        reference_cost=reference_cost / len(x),
    )


def entered(params: UGVParams, track: Track, placed: Pose) -> Values:
    """Penetration of the ground into a wheel of the poses [m], for use inside a trace."""
    wheels = placed.rear, placed.front
    r, samples = params.wheel_radius, NEWTON.samples
    return jnp.maximum(*(penetration(track, wheel, r, samples) for wheel in wheels))


def differences(
    params: UGVParams,
    truth: Equilibrium,
    got: Equilibrium,
    setting: Setting,
    depth: Callable[[], np.ndarray],
) -> Differences:
    """Errors of concrete poses [n] against the default solver's in float64; whose status is wrong.

    A status differs for a reason where a margin (normal force and grip over weight, clearances over
    wheel radius, stretch) is within ten times the pose's own error, and where the ground enters a
    wheel by less than the setting's precision tells (`depth_allowed`); depth: how deep it does [m],
    asked for only where a status depends on it.
    """
    params = jax.tree.map(np.asarray, params)
    r, weight = (np.asarray(v, float) for v in (params.wheel_radius, params.weight))
    status, own = np.asarray(truth.status), np.asarray(got.status)
    sound = ~np.isin(status, UNPLACED), ~np.isin(own, UNPLACED)
    both = sound[0] & sound[1]

    def off(a: ArrayLike, b: ArrayLike, scale: ArrayLike) -> np.ndarray:
        numbers = np.abs(np.asarray(a, float) - np.asarray(b, float)) / scale
        return np.where(both, numbers, np.nan)

    torque = off(truth.torque, got.torque, weight * r)
    contact = off(truth.pose.rear.x, got.pose.rear.x, r)
    unseen = np.isin(status, UNSEEN) & (setting.solver.samples == 0)
    error = np.maximum(torque, contact)
    near = _margin(truth, weight, r) <= 10 * error
    stretch = np.minimum(*(np.asarray(w.stretch) for w in (truth.pose.rear, truth.pose.front)))
    edge = np.abs(stretch) <= 1e3 * float(jnp.finfo(setting.dtype).eps)
    hollow = (status == Status.HOLLOW_GROUND) | (own == Status.HOLLOW_GROUND)
    wrong = (status != own) & ~np.where(both, near, hollow & edge) & ~unseen
    if np.any(wrong & hollow):
        shallow = np.asarray(depth()) <= _resolved(truth, r, setting)
        wrong &= ~(hollow & shallow)
    return Differences(torque, contact, wrong, unseen)


def _pose(x: float, rear: float, front: float) -> tuple[float, float, float]:
    return float(x), float(rear), float(front)


def _margin(truth: Equilibrium, weight: np.ndarray, r: np.ndarray) -> np.ndarray:
    """The least distance of a pose from another status [-]."""
    forces = (truth.N_rear, truth.N_front, truth.grip_rear, truth.grip_front)
    return np.min(
        [
            *(np.abs(np.asarray(v)) / weight for v in forces),
            *(np.abs(np.asarray(v)) / r for v in (truth.clearance, truth.wheel_clearance)),
        ],
        axis=0,
    )


def _resolved(truth: Equilibrium, radius: np.ndarray, setting: Setting) -> np.ndarray:
    """Penetration that the setting's precision cannot resolve [m]."""
    size = np.asarray(truth.pose.wheelbase) + 2 * radius
    return np.asarray(depth_allowed(size.astype(setting.dtype)), float)


def _poses(
    params: UGVParams,
    track: Track,
    x_front: Any,
    leg_angles: Any,
    count: int,
    seed: int,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 2"]]:
    """The given poses, or random ones, as [n] and [n, 2] in float64."""
    if (x_front is None) != (leg_angles is None):
        raise ValueError("x_front and leg_angles; accepted: both, or neither to have them drawn")
    if x_front is None:
        count = require_integer("count", count)
        require_integer("seed", seed, low=0)
        require_memory(f"count = {count}", "poses", count, POSE_BYTES)
        random = np.random.default_rng(seed)
        x = random.uniform(float(track.start), float(track.end), count)
        low, high = float(params.leg_angle_min), float(params.leg_angle_max)
        return x, random.uniform(low, high, (count, 2))
    require_number("x_front", x_front, accepted="finite numbers [m]")
    require_number("leg_angles", leg_angles, accepted="finite angles [rad]")
    params.check_leg_angles(leg_angles)
    x, angles = np.asarray(x_front, float), np.asarray(leg_angles, float)
    try:
        shape = np.broadcast_shapes(x.shape, angles.shape[:-1])
    except ValueError:
        raise ValueError(
            f"x_front has shape {x.shape}, leg_angles {angles.shape}; accepted: [...] and [..., 2]"
        ) from None
    require_memory(
        f"x_front with leg_angles of {shape}", "poses", float(np.prod(shape)), POSE_BYTES
    )
    return np.broadcast_to(x, shape).ravel(), np.broadcast_to(angles, (*shape, 2)).reshape(-1, 2)


def _in(dtype: str, values: Any) -> Any:
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), values)


_entered = jax.jit(entered)


def _timed(solver: PoseSolver, *arguments):
    """The solver's answer as NumPy arrays, and the processor seconds of a second call."""
    jax.block_until_ready(equilibrium(*arguments, solver=solver))
    begun = time.process_time()
    answer = jax.block_until_ready(equilibrium(*arguments, solver=solver))
    return jax.tree.map(np.asarray, answer), time.process_time() - begun
