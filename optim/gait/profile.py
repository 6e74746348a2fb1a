"""The inertia functions along support phases as float64 arrays, from the user's own robot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, exchange_mismatch, step_length
from stickslip.dynamics.biped.coefficients.inertia import inertia_and_moment
from stickslip.dynamics.biped.links import as_batch
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.numeric import read_only
from stickslip.optim.processes import refuse_after_fork

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.optim.gait.grid import Grid

BLOCK = 512
"""Crank angles computed at once: one program for every number of them."""
MISMATCH = 1e-6
"""Tolerated mismatch of the exchange of support, as in `simulate` in float64; single-precision
lengths are allowed their own rounding."""
NAMES = ("M", "dM", "P", "dP", "Y", "dY", "L", "dL", "X")


@dataclass(frozen=True)
class Profile:
    """M, P, Y, L, their slopes and X of MODEL 1.4 at crank angles theta [...], in float64.

    mass [kg], gravity [m/s^2] and the foot's edges heel, toe [m] beside them.
    """

    robot: Robot
    theta: Float[np.ndarray, "..."]
    M: Float[np.ndarray, "..."]
    dM: Float[np.ndarray, "..."]
    P: Float[np.ndarray, "..."]
    dP: Float[np.ndarray, "..."]
    Y: Float[np.ndarray, "..."]
    dY: Float[np.ndarray, "..."]
    L: Float[np.ndarray, "..."]
    dL: Float[np.ndarray, "..."]
    X: Float[np.ndarray, "..."]

    @property
    def fall(self) -> Float[np.ndarray, "..."]:
        """Slope of the potential energy by the crank angle, g Y [N m]."""
        return self.robot.gravity * self.Y


@dataclass(frozen=True)
class Robot:
    """Constants of the robot: whole mass [kg], gravity [m/s^2], the foot's edges behind
    and before the ankle [m], step length [m], length of the crank [m]."""

    mass: float
    gravity: float
    heel: float
    toe: float
    step_length: float
    crank: float

    @property
    def weight(self) -> float:
        """[N]"""
        return self.mass * self.gravity


@dataclass(frozen=True)
class Closely:
    """The profile at a grid's samples, computed when it is first used."""

    params: BipedParams
    robot: Robot
    grid: Grid

    @cached_property
    def profile(self) -> Profile:
        """[n, K, D+1]"""
        return profile_of(self.params, self.robot, self.grid.samples)


def robot_of(params: BipedParams, steps: int, periodic: bool) -> Robot:
    """The robot's constants; ValueError for a batch of robots, or for one that cannot hand over its
    support without an impact where it has to."""
    accepted = "a BipedParams of one robot (carry a payload in params.payload)"
    require_kind("params", params, BipedParams, accepted)
    if batch := as_batch(params)[0]:
        raise ValueError(f"params is a batch of shape {batch}; accepted: one robot")
    params.validate()
    refuse_after_fork()
    kind = jnp.result_type(params.crank)
    with jax.enable_x64(True):
        wide = params.astype(jnp.float64)
        constants = _constants(wide)
        mismatch = float(constants[-1])
    most = max(MISMATCH, 1e3 * float(jnp.finfo(kind).eps))
    if (steps > 1 or periodic) and not mismatch < most:
        raise ValueError(
            f"this linkage breaks the exchange of support by {mismatch:.3g} (crank lengths or "
            f"rad); accepted: below {most:.1g}, or a transfer of one step"
        )
    mass, length = float(constants[0]), float(constants[1])
    names = ("gravity", "heel", "toe", "crank")
    rest = {name: float(np.asarray(getattr(wide, name))) for name in names}
    return Robot(mass=mass, step_length=length, **rest)


def profile_of(params: BipedParams, robot: Robot, theta: Float[np.ndarray, "..."]) -> Profile:
    """The profile at any crank angles of the supporting leg, exact (`inertia_and_moment`)."""
    refuse_after_fork()
    angles, where = np.unique(np.ravel(theta), return_inverse=True)
    blocks = -(-len(angles) // BLOCK)
    padded = np.pad(angles, (0, blocks * BLOCK - len(angles)), mode="edge")
    with jax.enable_x64(True):
        wide = params.astype(jnp.float64)
        rows = [
            np.asarray(_numbers(wide, jnp.asarray(block))) for block in np.split(padded, blocks)
        ]
    columns = np.concatenate(rows, axis=1)[:, where].reshape(len(NAMES), *np.shape(theta))
    columns = read_only(columns)
    if not np.all(np.isfinite(columns)):
        raise ValueError("params give inertia functions that are not finite in double precision")
    return Profile(robot, read_only(theta), *columns)


@jax.jit
def _numbers(params: BipedParams, theta: Float[Array, " n"]) -> Float[Array, "9 n"]:
    def at(angle: Float[Array, ""]) -> Float[Array, " 9"]:
        inertia, moment = inertia_and_moment(params, angle)
        return jnp.stack([*inertia, moment.L, moment.dL, moment.X])

    return jax.vmap(at, out_axes=1)(theta)


@jax.jit
def _constants(params: BipedParams) -> tuple[Float[Array, ""], ...]:
    return params.total_mass, step_length(params), exchange_mismatch(params)
