"""The torques' split between the UGV's axles along a drive: convex, one number a station."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import UGVParams, equilibrium
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.instances.ugv.posture import STRAIGHT, track_named
from stickslip.optim.problem import Structure
from stickslip.optim.torque_split.family import Family

if TYPE_CHECKING:
    from collections.abc import Callable

    import cvxpy as cp
    from jaxtyping import Array, Float

FRICTION = 0.8


class Drive(NamedTuple):
    """A drive with straight legs, in units of the vehicle's weight. equal, per_newton: [K, 4] as in
    Family. torque: what a weight at the wheels' radius makes [N m]."""

    equal: Float[Array | np.ndarray, "K 4"]
    per_newton: Float[Array | np.ndarray, "K 4"]
    torque: Float[Array | np.ndarray, ""]


class SplitProblem(FunctionProblem):
    """The split of a drive; data: a Drive."""

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "K"]]]:
        """See Problem."""
        import cvxpy as cp

        drive = jax.tree.map(np.asarray, self.data)
        x = cp.Variable(self.n)
        forces = [drive.equal[:, i] + cp.multiply(drive.per_newton[:, i], x) for i in range(4)]
        limits: list[cp.Constraint] = [x >= self.low, x <= self.high]
        for F, N in (forces[:2], forces[2:]):
            limits += [cp.abs(F) <= FRICTION * N, N >= 0]
        along = [forces[0], forces[2]]
        if self.function is _squared:
            goal = sum(cp.sum_squares(F) for F in along) * float(drive.torque) ** 2
        else:
            goal = cp.max(cp.abs(cp.hstack(along))) * float(drive.torque)
        return cp.Problem(cp.Minimize(goal), limits), lambda: np.asarray(x.value, float)


def split_problem(track: str, criterion: str, stations: int) -> SplitProblem:
    """F_front - F_rear at every station, in weights, that keeps grip at both wheels.

    criterion: "squared_torque": the sum of both motors' torques squared, over the stations
    [N^2 m^2]; "peak_torque": the largest of all [N m].
    """
    params, family = UGVParams(), drive_family(track, stations)
    weight = float(params.weight)
    drive = Drive(
        family.equal / weight, family.per_newton, np.asarray(weight * params.wheel_radius)
    )
    function = {"squared_torque": _squared, "peak_torque": _peak}[criterion]
    kinds = frozenset({Structure.SMOOTH, Structure.CONVEX})
    most = np.full(stations, 1.0)
    return SplitProblem(function, drive, -most, most, kind=kinds)


def drive_family(track: str, stations: int) -> Family:
    """All splits of a drive with straight legs over the middle of a track, [stations]."""
    ground, params = track_named(track), UGVParams()
    start, end = float(np.asarray(ground.start)), float(np.asarray(ground.end))
    x = np.linspace(start + 2.0, end - 0.5, stations)
    angles = np.broadcast_to(STRAIGHT, (stations, 2))
    return Family.of(params, equilibrium(params, ground.astype(np.float64), x, angles))


def _forces(drive: Drive, x: Float[Array, "K"]) -> tuple[Array, Array, Array]:
    """F [K, 2], N [K, 2] in weights, and what is left of grip and of normal force [6 K]."""
    forces = jnp.asarray(drive.equal) + x[:, None] * drive.per_newton
    F, N = forces[:, ::2], forces[:, 1::2]
    margins = [FRICTION * N - F, FRICTION * N + F, N]
    return F, N, jnp.concatenate([jnp.ravel(one) for one in margins])


def _squared(drive: Drive, x: Array, draw: Array) -> tuple[Array, Array]:
    F, _, margins = _forces(drive, x)
    return jnp.sum((F * drive.torque) ** 2)[None], margins


def _peak(drive: Drive, x: Array, draw: Array) -> tuple[Array, Array]:
    F, _, margins = _forces(drive, x)
    return jnp.max(jnp.abs(F * drive.torque))[None], margins
