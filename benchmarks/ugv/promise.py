"""Errors and statuses of settings over a population: what `recommend` may promise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.points import upper_bound
from benchmarks.report import code_of
from benchmarks.ugv.population import CHOSEN, CLASSES, HELD_OUT, PLACES, Drawn, draw
from stickslip.dynamics import Status
from stickslip.dynamics.ugv import (
    Equilibrium,
    Pose,
    PoseSolver,
    Track,
    UGVParams,
    equilibrium,
)
from stickslip.dynamics.ugv.wheel import NEWTON, depth_allowed, penetration

UNPLACED = (Status.NO_SOLUTION, Status.NON_FINITE, Status.NOT_CONVERGED, Status.HOLLOW_GROUND)
"""Poses with one of these have no numbers to compare."""
COUNT = 1 << 14
"""Poses of each class and place, and as many held out."""
BLOCK = 512
QUANTILE, CONFIDENCE = 0.999, 0.95
FRICTION = 0.8
SURE = 1e-15
"""[-]: smaller errors are not claimed."""
SOLVERS = (
    PoseSolver(),
    PoseSolver(samples=0),
    PoseSolver(samples=0, tolerance=1e-4),
)
QUICK = SOLVERS[1:3]
UNSEEN = (Status.HOLLOW_GROUND, Status.GROUNDED)
"""Statuses that a setting without the checks cannot detect."""


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


class Sample(NamedTuple):
    """Poses, the reference's answers to them, and by how much the reference itself is off."""

    drawn: Drawn
    truth: Equilibrium
    rounding: Differences


def promises(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each class of ground, place and setting."""
    count = 1 << 12 if quick else COUNT
    with jax.enable_x64(True):
        for ground in CLASSES[:1] if quick else CLASSES:
            for where in PLACES:
                samples = [sample(ground, where, count, seed) for seed in (CHOSEN, HELD_OUT)]
                for solver in QUICK if quick else SOLVERS:
                    for dtype in ("float64", "float32"):
                        off = [errors(one, solver, dtype) for one in samples]
                        names = {"ground": ground, "place": where, "solver": code_of(solver)}
                        yield {**names, "dtype": dtype, **promised(*off)}


def sample(ground: str, where: str, count: int, seed: int) -> Sample:
    """The poses with their reference; under enable_x64."""
    drawn = draw(ground, where, count, seed)
    wanted = answers_of(NEWTON, drawn)
    moved = answers_of(NEWTON, draw(ground, where, count, seed, shifted=True))
    return Sample(drawn, wanted, rounding(drawn, wanted, moved))


def rounding(drawn: Drawn, wanted: Equilibrium, moved: Equilibrium) -> Differences:
    """Differences of the reference from itself when ground and vehicle are moved along x."""
    there = moved.pose
    shift = there.front.x - wanted.pose.front.x
    rear = there.rear._replace(x=there.rear.x - shift)
    found = moved._replace(pose=there._replace(rear=rear))
    depth = partial(depths, drawn, wanted)
    return differences(drawn.params, wanted, found, NEWTON, "float64", depth)


def differences(
    params: UGVParams,
    truth: Equilibrium,
    got: Equilibrium,
    solver: PoseSolver,
    dtype: str,
    depth: Callable[[], np.ndarray],
) -> Differences:
    """Errors of concrete poses [n] against the default solver's in float64; whose status is wrong.

    A status differs for a reason where a margin (normal force and grip over weight, clearances over
    wheel radius, stretch) is within ten times the pose's own error, and where the ground enters a
    wheel by less than the precision tells (`depth_allowed`); depth: how deep it does [m],
    asked for only where a status depends on it.
    """
    params = jax.tree.map(np.asarray, params)
    r, weight = (np.asarray(v, float) for v in (params.wheel_radius, params.weight))
    status, own = np.asarray(truth.status), np.asarray(got.status)
    sound = ~np.isin(status, UNPLACED), ~np.isin(own, UNPLACED)
    both = sound[0] & sound[1]

    def off(a: Any, b: Any, scale: Any) -> np.ndarray:
        numbers = np.abs(np.asarray(a, float) - np.asarray(b, float)) / scale
        return np.where(both, numbers, np.nan)

    torque = off(truth.torque, got.torque, weight * r)
    contact = off(truth.pose.rear.x, got.pose.rear.x, r)
    unseen = np.isin(status, UNSEEN) & (solver.samples == 0)
    error = np.maximum(torque, contact)
    near = _margin(truth, weight, r) <= 10 * error
    stretch = np.minimum(*(np.asarray(w.stretch) for w in (truth.pose.rear, truth.pose.front)))
    edge = np.abs(stretch) <= 1e3 * float(jnp.finfo(dtype).eps)
    hollow = (status == Status.HOLLOW_GROUND) | (own == Status.HOLLOW_GROUND)
    wrong = (status != own) & ~np.where(both, near, hollow & edge) & ~unseen
    if np.any(wrong & hollow):
        shallow = np.asarray(depth()) <= _resolved(truth, r, dtype)
        wrong &= ~(hollow & shallow)
    return Differences(torque, contact, wrong, unseen)


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


def _resolved(truth: Equilibrium, radius: np.ndarray, dtype: str) -> np.ndarray:
    """Penetration that the precision cannot resolve [m]."""
    size = np.asarray(truth.pose.wheelbase) + 2 * radius
    return np.asarray(depth_allowed(size.astype(dtype)), float)


def errors(sample: Sample, solver: PoseSolver, dtype: str) -> Differences:
    """Differences of a setting from the reference, whose own rounding counts as the setting's."""
    answers = answers_of(solver, sample.drawn, dtype)
    depth = partial(depths, sample.drawn, sample.truth)
    off = differences(sample.drawn.params, sample.truth, answers, solver, dtype, depth)
    own = sample.rounding
    return off._replace(
        torque=np.maximum(off.torque, np.nan_to_num(own.torque)),
        contact=np.maximum(off.contact, np.nan_to_num(own.contact)),
    )


def promised(chosen: Differences, held_out: Differences) -> dict[str, Any]:
    """Median, bound of the quantile and largest error of each number; statuses; and how often
    the poses held out exceed the promise."""
    row: dict[str, Any] = {}
    exceeded = np.zeros(len(held_out.torque), bool)
    for name in ("torque", "contact"):
        mine = getattr(chosen, name)
        mine = np.maximum(np.sort(mine[np.isfinite(mine)]), SURE)
        bound = upper_bound(mine, QUANTILE, CONFIDENCE)
        row[name] = [float(np.median(mine)), bound, float(mine[-1])]
        row["poses"] = len(mine)
        exceeded |= np.nan_to_num(getattr(held_out, name)) > bound
    return row | {
        "wrong": int(np.sum(chosen.wrong)),
        "unseen": int(np.sum(chosen.unseen)),
        "held_out": int(np.sum(np.isfinite(held_out.error))),
        "held_out_over": int(np.sum(exceeded)),
        "held_out_wrong": int(np.sum(held_out.wrong)),
    }


def answers_of(solver: PoseSolver, drawn: Drawn, dtype: str = "float64") -> Equilibrium:
    """A solver's answers to all poses."""
    poses = drawn.params, drawn.shape, drawn.x, drawn.angles
    return _run_over(_answer(solver), poses, dtype)


@cache
def _answer(solver: PoseSolver):
    def answer(params, shape, x, angles):
        return equilibrium(params, Track(shape, 0.0, 1.0), x, angles, FRICTION, solver=solver)

    return answer


def depths(drawn: Drawn, wanted: Equilibrium) -> np.ndarray:
    """Depth to which the ground enters a wheel of each pose [m]."""
    return _run_over(_depth, (drawn.params, drawn.shape, wanted.pose))


def _depth(params: UGVParams, shape, placed: Pose) -> jax.Array:
    track, r = Track(shape, 0.0, 1.0), params.wheel_radius
    wheels = placed.rear, placed.front
    return jnp.maximum(*(penetration(track, wheel, r, NEWTON.samples) for wheel in wheels))


def _run_over(function, arguments, dtype: str = "float64"):
    """The function of each row of the arguments, in blocks, as NumPy arrays."""
    arguments = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), arguments)
    return jax.tree.map(np.asarray, _mapped(function)(arguments))


@cache
def _mapped(function):
    return jax.jit(lambda rows: jax.lax.map(lambda row: function(*row), rows, batch_size=BLOCK))
