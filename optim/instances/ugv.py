"""The UGV's instances: leg angles and torque splits over tracks, and designs of the vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import Track, UGVParams, equilibrium
from stickslip.dynamics.ugv.statics import split_family
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.instances.instance import drawn
from stickslip.optim.posture.evaluate import Posture, finite_cost
from stickslip.optim.posture.problem import PostureProblem
from stickslip.optim.problem import Structure

if TYPE_CHECKING:
    import cvxpy as cp
    from jaxtyping import Array, Float


STRAIGHT = np.full(2, np.pi / 2)
LEG_RATE = 1.0
ROUGH = {"key": 7, "end": 10.0}
"""The rough track: of ISO class C, generated from this key."""
FRICTION = 0.8
VEHICLE = {"body_length": (0.6, 1.1), "leg_length": (0.25, 0.45)}
"""Design variables of the UGV [m]; then the fixed leg angles [rad]."""
LEGS = (np.pi / 3, 2 * np.pi / 3)
STATIONS = 48
SHAPES = 0.1
"""Spread of a drawn track's numbers: the foot of the step stays less hollow than the wheel."""
NUMBERS = ("body_length", "leg_length", "wheel_mass", "body_mass", "leg_mass")
"""Numbers of a drawn vehicle."""


def track_named(name: str, seed: int | None = None) -> Track:
    """A track of the suite: those of `Track`, "rough" from ROUGH; drawn: see `drawn`."""
    if name == "rough":
        return Track.named(name, **ROUGH | ({} if seed is None else {"key": 1000 + seed}))
    return Track.named(name, **drawn(seed, spread=SHAPES, **vars(Track.named(name).shape)))


def vehicle(seed: int | None) -> UGVParams:
    """The usual vehicle, or one that is drawn."""
    usual = UGVParams()
    return usual.replace(**drawn(seed, **{name: getattr(usual, name) for name in NUMBERS}))


def posture_problem(
    track: str, criterion: str, free: int, ends: str = "start", seed: int | None = None
) -> PostureProblem:
    """`free` numbers to choose over the whole of a track; seed: of track, vehicle and limits.

    ends: "start": legs straight down at the first waypoint, the last free; "both": straight down at
    both; "none": all free. The waypoints are as many as that takes, evenly spaced, and legs turn by
    at most LEG_RATE [rad/m].
    """
    given = {"start": 1, "both": 2, "none": 0}[ends]
    limits: dict[str, Any] = {"friction": FRICTION, "leg_rate": LEG_RATE}
    limits |= dict.fromkeys(("start_angles", "end_angles")[:given], STRAIGHT)
    on, params = track_named(track, seed), vehicle(seed)
    usual = PostureProblem.along(on, criterion, params, **drawn(seed, **limits))
    return replace(usual, x=np.linspace(usual.x[0], usual.x[-1], free // 2 + given))


class Drive(NamedTuple):
    """Ground forces of a drive with straight legs, in units of the vehicle's weight.

    With a motor at each wheel, equilibrium leaves the difference F_front - F_rear free. equal:
    [K, 4], F_rear, N_rear, F_front, N_front where it is 0. per_newton: [K, 4], what each newton of
    it adds [-]. torque: what a weight at the wheels' radius makes [N m].
    """

    equal: Float[Array | np.ndarray, "K 4"]
    per_newton: Float[Array | np.ndarray, "K 4"]
    torque: Float[Array | np.ndarray, ""]


class SplitProblem(FunctionProblem):
    """The split of a drive; data: a Drive."""

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "K"]]]:
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


def split_problem(
    track: str, criterion: str, stations: int, seed: int | None = None
) -> SplitProblem:
    """F_front - F_rear at each station over a track's middle, in weights, that keeps grip.

    criterion: "squared_torque": the sum of both motors' torques squared, over the stations
    [N^2 m^2]; "peak_torque": the largest of all [N m]. What a newton adds is taken for none where
    it is below rounding: on a straight slope the normal forces do not depend on the split. seed: of
    track, vehicle and the middle of the box, which without it is nearly the best point.
    """
    ground, params = track_named(track, seed), vehicle(seed)
    start, end = float(np.asarray(ground.start)), float(np.asarray(ground.end))
    x = np.linspace(start + 2.0, end - 0.5, stations)
    angles = np.broadcast_to(STRAIGHT, (stations, 2))
    pose = equilibrium(params, ground.astype(np.float64), x, angles).pose
    equal, per_newton = (np.stack(of, -1) for of in split_family(params, pose))
    per_newton = np.where(abs(per_newton) < 16 * np.finfo(equal.dtype).eps, 0.0, per_newton)
    drive = Drive(equal, per_newton, np.asarray(float(params.weight) * params.wheel_radius))
    function = {"squared_torque": _squared, "peak_torque": _peak}[criterion]
    kinds = frozenset({Structure.SMOOTH, Structure.CONVEX})
    most = np.full(stations, 1.0)
    low, high = drawn(seed, spread=0.5, low=-most, high=most).values()
    return SplitProblem(function, drive, low, high, kind=kinds)


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


@dataclass(frozen=True)
class VehicleDesign:
    """A vehicle with fixed legs over a family of tracks: the mean of its criterion's values.

    Margins: those of `Posture.margins` at every station of every track, the least of each kind.
    """

    def __call__(
        self, data: tuple[Posture, ...], x: Float[Array, "n"], draw: Array
    ) -> tuple[Array, Array]:
        """Value [1] and margins [kinds of all tracks]."""
        numbers = dict(zip(VEHICLE, x, strict=False))
        angles = jnp.broadcast_to(x[len(VEHICLE) :], (STATIONS, 2))
        values, margins = [], []
        for each in data:
            posture = replace(each, params=each.params.replace(**numbers))
            at = posture.stations(angles)
            values.append(finite_cost(posture.criterion, at))
            margins += [jnp.min(of, axis=0) for of in posture.margins(at).values()]
        return jnp.mean(jnp.stack(values))[None], jnp.concatenate(margins)


def vehicle_design(
    criterion: str, tracks: tuple[str, ...], seed: int | None = None
) -> FunctionProblem:
    """Wheelbase, leg length and angles for several tracks at once; seed: of tracks, masses, box."""
    data, params = [], vehicle(seed)
    for track in (track_named(name, seed) for name in tracks):
        start, end = float(np.asarray(track.start)), float(np.asarray(track.end))
        problem = PostureProblem.along(track, criterion, params, leg_rate=None)
        data.append(replace(problem, x=np.linspace(start + 2.5, end, STATIONS)).posture)
    low, high = np.array([*VEHICLE.values(), LEGS, LEGS]).T
    low, high = drawn(seed, low=low, high=high).values()
    return FunctionProblem(VehicleDesign(), tuple(data), low, high, forward=True)
