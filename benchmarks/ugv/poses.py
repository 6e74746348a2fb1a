"""Random ground, vehicles and postures, and errors and statuses of settings over them: what
`recommend` may promise.

Every pose has a vehicle and a piece of ground of its own, so that poses are independent and
quantiles can be bounded by their number. Lengths are drawn in wheel radii. Ground reaches from
gentle to as hollow as the wheel, a fifth of it beyond, with slopes up to 0.9.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy import interpolate

from benchmarks.report import code_of, upper_bound
from stickslip.dynamics import Status
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.dynamics.ugv import Equilibrium, Pose, PoseSolver, Track, UGVParams, equilibrium
from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.ground.shapes import Bump, Closed, Ditch, Ramp, Sinusoid, Step, in_two
from stickslip.dynamics.ugv.ground.spline import Spline, hermite_table
from stickslip.dynamics.ugv.recommendation import FAR, NEAR
from stickslip.dynamics.ugv.wheel import NEWTON, depth_allowed, penetration

PLACES = {"near": (0.0, NEAR), "far": (NEAR, FAR)}
"""Distance of the pose from the origin along x, in wheel radii; up to half of it upwards."""
CHOSEN, HELD_OUT = 0, 1
"""Seeds: of the draws that tables are written from, and of those that the promise is tested on."""
STEEPEST = 0.9
"""Largest slope [-]."""
HOLLOWEST, TOO_HOLLOW, SHARE = 1.05, 6.0, 0.2
"""Largest second derivative times the wheel's radius [-], where 1 is hollower than the wheel; that
of ground which is too hollow, and the share of such ground."""
POINTS = 32
"""Pieces of a spline through points."""
AS_FUNCTION = {"closed function": "closed", "waves function": "waves"}
"""Classes of ground known by their heights alone, as a user's function is."""
CLASSES = ("closed", "waves", "spline", *AS_FUNCTION)
UNPLACED = (Status.NO_SOLUTION, Status.NON_FINITE, Status.NOT_CONVERGED, Status.HOLLOW_GROUND)
"""Poses with one of these have no numbers to compare."""
COUNT = 1 << 14
"""Poses of each class and place, and as many held out."""
BLOCK = 512
QUANTILE, CONFIDENCE = 0.999, 0.95
FRICTION = 0.8
SURE = 1e-15
"""[-]: smaller errors are not claimed."""
SOLVERS = (PoseSolver(), PoseSolver(samples=0), PoseSolver(samples=0, tolerance=1e-4))
DTYPES = ("float64", "float32")
CHECKED = (Status.HOLLOW_GROUND, Status.GROUNDED)
"""Statuses that a setting without samples cannot detect."""


@pytree_dataclass
class Together(Closed):
    """A sum of shapes, raised by a height [m]: one program for all closed forms."""

    shapes: tuple
    height: Any

    def greatest_bend(self, radius):
        """Not known."""

    def near(self, base, u):
        """Heights, slopes and second derivatives added; the height by itself."""
        seen = [shape.near(base, u) for shape in self.shapes]
        y = sum(sum(parts) for parts, _, _ in seen)
        dy, d2y = (sum(one[k] for one in seen) for k in (1, 2))
        return (self.height + 0 * y, y), dy, d2y


@pytree_dataclass
class Known:
    """A ground known by its heights at places in the world, as a user's function is."""

    ground: Together

    def profile(self, x):
        """The ground's."""
        return self.ground.profile(x)


class Drawn(NamedTuple):
    """Independent poses [n]: each with a vehicle, a ground, a front contact [m], angles [rad]."""

    params: UGVParams
    shape: Any
    x: np.ndarray
    angles: np.ndarray


def draw(ground: str, place: str, count: int, seed: int = CHOSEN, shifted: bool = False) -> Drawn:
    """`count` poses on a class of ground, near the origin or far from it; float64.

    shifted: the same poses with ground and vehicle moved along x, for the rounding of an answer.
    """
    random = np.random.default_rng((seed, CLASSES.index(ground), list(PLACES).index(place)))
    params = vehicles(random, count)
    r = np.asarray(params.wheel_radius)
    low, high = PLACES[place]
    away = np.exp(random.uniform(np.log(max(low, 1.0)), np.log(high), count))
    at = away * random.choice([-1.0, 1.0], count) * r
    height = random.choice([0.0, 0.5], count) * away * random.uniform(0, 1, count) * r
    over = random.uniform(0, 1, count) < SHARE
    hollow = random.uniform(over * HOLLOWEST, np.where(over, TOO_HOLLOW, HOLLOWEST))
    limits = Limits(r, hollow, random.uniform(over * STEEPEST / 2, STEEPEST))
    shape, x = _GROUNDS[AS_FUNCTION.get(ground, ground)](random, limits, at, height, shifted)
    if ground in AS_FUNCTION:
        shape = Known(shape)
    part = random.uniform(0, 1, (count, 2))
    bottom, top = (np.asarray(v)[:, None] for v in (params.leg_angle_min, params.leg_angle_max))
    return Drawn(params, shape, x, bottom + part * (top - bottom))


class Limits(NamedTuple):
    """Largest second derivative times radius, and slope, of the ground at each pose."""

    radius: np.ndarray
    hollow: np.ndarray
    slope: np.ndarray

    def least(self, by_curvature, by_slope):
        """An amplitude from its values for second derivative 1 / r and for slope 1."""
        return np.minimum(self.hollow * by_curvature, self.slope * by_slope)


def vehicles(random: np.random.Generator, count: int) -> UGVParams:
    """Wheels of 0.1 to 1 m; bodies, legs, angles and masses about the default's proportions."""
    r = _log_uniform(random, 0.1, 1.0, count)
    body, leg = r * random.uniform(2, 5, count), r * random.uniform(0.8, 1.8, count)
    low = np.deg2rad(random.uniform(20, 50, count))
    # Legs fold inwards until the wheelbase is a sixth of the body.
    low = np.maximum(low, np.arccos(np.minimum(5 / 6 * body / (2 * leg), 1)))
    mass = _log_uniform(random, 10, 1000, count)
    wheel, legs = random.uniform(0.02, 0.15, count), random.uniform(0.0, 0.1, count)
    return UGVParams(
        body_length=body,
        leg_length=leg,
        wheel_radius=r,
        wheel_mass=wheel * mass,
        leg_mass=legs * mass,
        body_mass=(1 - 2 * wheel - 2 * legs) * mass,
        gravity=np.full(count, 9.81),
        wheel_gap=np.zeros(count),
        leg_angle_min=low,
        leg_angle_max=np.deg2rad(random.uniform(100, 160, count)),
    )


def _closed(random, limits: Limits, at, height, shifted):
    """One of the closed forms each; the others have no height."""
    r, n = limits.radius, len(at)
    kind = random.integers(0, 5, n)
    sign = random.choice([-1.0, 1.0], n)
    length = r * _log_uniform(random, 1.0, 30.0, n)
    second = length * random.uniform(1.0, 3.0, n)
    beside = random.uniform(-1, 1, n) * (length + 3 * r)
    # The sinusoid has no place: it is shifted by whole waves.
    at = at + np.where(shifted, np.where(kind == 1, length, 0.377 * r), 0.0)

    def sized(which, curved, steep):
        return np.where(kind == which, limits.least(curved, steep), 0.0)

    k = 2 * np.pi / length
    step = limits.least(length**2 / 5.7735 / r, length / 1.875)
    bump = sized(0, np.where(sign > 0, 1 / 0.8925, 0.5) * length**2 / r, length / 0.8578)
    shapes = (
        Bump(sign * bump, at, length),
        Sinusoid(sized(1, 1 / (k * k * r), 1 / k), length),
        Ramp(sign * sized(2, length / 1.5 / r, np.ones(n)), at, second, length),
        Step(sign * np.where(kind == 3, step, 0.0), at, length),
        Ditch(sign * np.where(kind == 4, step, 0.0), at, second, length),
    )
    # A ditch and a ramp are longer: half the poses are at their far end.
    late = np.where((kind == 2) | (kind == 4), random.choice([0.0, 1.0], n) * second, 0.0)
    return Together(shapes, height), at + beside + late


def _drawn_waves(random, limits: Limits) -> tuple[Waves, np.ndarray]:
    """Waves and the length of the shortest [m]: half are one to eight sines of any length, half a
    band with the spectrum of ISO 8608 cut into 16."""
    n, r, count = len(limits.radius), limits.radius, 16
    shortest = r * _log_uniform(random, 3.0, 40.0, n)
    rough = random.uniform(0, 1, n) < 0.5
    sines = np.sort(_log_uniform(random, 0.02, 1.0, (n, count)), axis=1)
    band = np.linspace(0.05, 1.0, count + 1)
    middles = np.sqrt(band[:-1] * band[1:])
    relative = np.where(rough[:, None], middles / middles[-1], sines / sines[:, -1:])
    power = np.where(rough, 1.0, random.uniform(0, 3, n))[:, None]
    size = relative**-power * np.where(rough[:, None], 1.0, random.uniform(0.2, 1, (n, count)))
    kept = rough[:, None] | (np.arange(count) >= count - random.integers(1, 9, n)[:, None])
    frequencies = relative / shortest[:, None]
    phases = random.uniform(0, 2 * np.pi, (n, count))
    size, k = size * kept, 2 * np.pi * frequencies
    # Waves seldom add up: twice the root mean square stands for the largest.
    steep, curved = (np.sqrt(2 * np.sum((size * k**p) ** 2, 1)) for p in (1, 2))
    amplitudes = size * limits.least(1 / curved / r, 1 / steep)[:, None]
    return Waves(amplitudes, frequencies, phases), shortest


def _waves(random, limits: Limits, at, height, shifted):
    waves, _ = _drawn_waves(random, limits)
    moved = np.where(shifted, 0.377 * limits.radius, 0.0)
    phases = np.mod(waves.phases - 2 * np.pi * waves.frequencies * moved[:, None], 2 * np.pi)
    return Together((replace(waves, phases=phases),), height), at + moved


def _spline(random, limits: Limits, at, height, shifted):
    """A quarter each: cubic, pchip and makima through points, and a table of quintics of waves."""
    r, n = limits.radius, len(at)
    kind = random.integers(0, len(_FITTED) + 1, n)
    rows, spacing = _through_points(random, limits, kind)
    table = _table(random, limits)
    quintic = kind == len(_FITTED)
    rows = np.where(quintic[:, None, None], table[0], rows)
    spacing = np.where(quintic, table[1], spacing)
    rows[..., 0] += height[:, None]
    at = at + np.where(shifted, 0.377 * r, 0.0)
    first = at - spacing * random.uniform(8, POINTS, n)
    heights, lows = in_two(rows[..., 0])
    rows = np.concatenate([heights[..., None], rows[..., 1:]], axis=-1)
    knots = first[:, None] + spacing[:, None] * np.arange(POINTS + 1)
    return Spline(*in_two(knots), rows, lows, even=True), at


def _through_points(random, limits: Limits, kind):
    """Splines through noise or a twice summed walk, scaled: [n, pieces, 6], spacing."""
    n, knots = len(kind), np.arange(POINTS + 1.0)
    noise = random.normal(size=(n, POINTS + 1))
    walk = np.cumsum(np.cumsum(random.normal(size=noise.shape), 1), 1)
    y = np.where(random.uniform(0, 1, (n, 1)) < 0.5, noise, walk)
    rows = np.zeros((n, POINTS, 6))
    for which, fitted in enumerate(_FITTED):
        mine = kind == which
        rows[mine, :, :4] = np.transpose(fitted(knots, y[mine].T).c, (2, 1, 0))[..., ::-1]
    spacing = limits.radius * _log_uniform(random, 0.35, 5.0, n)
    # In pieces: the slope and the second derivative at their ends.
    steep = np.abs(rows[..., 1]).max(1)
    bent = np.maximum(2 * rows[..., 2], 2 * rows[..., 2] + 6 * rows[..., 3]).max(1)
    least = 1e-9  # of ground that is a table, or straight
    curved, sloped = spacing**2 / np.maximum(bent, least), spacing / np.maximum(steep, least)
    rows *= limits.least(curved / limits.radius, sloped)[:, None, None]
    return rows / spacing[:, None, None] ** np.arange(6), spacing


def _table(random, limits: Limits):
    """Waves as a table with 8 pieces for the shortest: rows [n, pieces, 6] and spacing [m]."""
    waves, shortest = _drawn_waves(random, limits)
    spacing = shortest / 8

    def table(shape, spacing):
        return hermite_table(shape.profile, 0.0, POINTS * spacing, POINTS).coefficients

    with jax.enable_x64(True):
        rows = jax.jit(jax.vmap(table))(waves, spacing)
    return np.asarray(rows), spacing


def _log_uniform(random, low: float, high: float, size) -> np.ndarray:
    return np.exp(random.uniform(np.log(low), np.log(high), size))


_FITTED: tuple[Callable[..., Any], ...] = (
    lambda x, y: interpolate.CubicSpline(x, y, bc_type="natural"),
    interpolate.PchipInterpolator,
    lambda x, y: interpolate.Akima1DInterpolator(x, y, method="makima"),
)
_GROUNDS = {"closed": _closed, "waves": _waves, "spline": _spline}


class Differences(NamedTuple):
    """Errors of each pose [n], NaN where either has no numbers."""

    torque: np.ndarray
    """Error of the torque, over weight times wheel radius [-]."""
    contact: np.ndarray
    """Error of the rear contact, in wheel radii [-]."""
    wrong: np.ndarray
    """True if the status differs though the errors do not explain it."""


class Sample(NamedTuple):
    """Poses, the reference's answers to them, and by how much the reference itself is off."""

    drawn: Drawn
    truth: Equilibrium
    rounding: Differences


def promises(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each class of ground, place and setting."""
    count = 1 << 12 if quick else COUNT
    with jax.enable_x64(True):
        for ground, where in product(CLASSES[:1] if quick else CLASSES, PLACES):
            samples = [sample(ground, where, count, seed) for seed in (CHOSEN, HELD_OUT)]
            for solver, dtype in product(SOLVERS[1:] if quick else SOLVERS, DTYPES):
                off = [errors(one, solver, dtype) for one in samples]
                names = {"ground": ground, "place": where, "solver": code_of(solver)}
                yield {**names, "dtype": dtype, **promised(*off)}


def sample(ground: str, where: str, count: int, seed: int) -> Sample:
    """The poses with their reference, and its differences from itself when ground and vehicle are
    moved along x; under enable_x64."""
    drawn = draw(ground, where, count, seed)
    wanted = answers_of(NEWTON, drawn)
    moved = answers_of(NEWTON, draw(ground, where, count, seed, shifted=True))
    there = moved.pose
    rear = there.rear._replace(x=there.rear.x - (there.front.x - wanted.pose.front.x))
    back = moved._replace(pose=there._replace(rear=rear))
    return Sample(drawn, wanted, differences(drawn, wanted, back, NEWTON, "float64"))


def differences(
    drawn: Drawn, truth: Equilibrium, got: Equilibrium, solver: PoseSolver, dtype: str
) -> Differences:
    """Errors of concrete poses [n] against the default solver's in float64; whose status is wrong.

    A status differs for a reason where a margin (normal force and grip over weight, clearances over
    wheel radius, stretch) is within ten times the pose's own error, and where the ground enters a
    wheel by less than the precision tells (`depth_allowed`).
    """
    r, weight = (np.asarray(v, float) for v in (drawn.params.wheel_radius, drawn.params.weight))
    status, own = np.asarray(truth.status), np.asarray(got.status)
    sound = ~np.isin(status, UNPLACED), ~np.isin(own, UNPLACED)
    both = sound[0] & sound[1]

    def off(a: Any, b: Any, scale: Any) -> np.ndarray:
        return np.where(both, np.abs(np.asarray(a, float) - np.asarray(b, float)) / scale, np.nan)

    torque = off(truth.torque, got.torque, weight * r)
    contact = off(truth.pose.rear.x, got.pose.rear.x, r)
    unseen = np.isin(status, CHECKED) & (solver.samples == 0)
    near = _margin(truth, weight, r) <= 10 * np.maximum(torque, contact)
    stretch = np.minimum(*(np.asarray(w.stretch) for w in (truth.pose.rear, truth.pose.front)))
    edge = np.abs(stretch) <= 1e3 * float(jnp.finfo(dtype).eps)
    hollow = (status == Status.HOLLOW_GROUND) | (own == Status.HOLLOW_GROUND)
    wrong = (status != own) & ~np.where(both, near, hollow & edge) & ~unseen
    if np.any(wrong & hollow):
        size = np.asarray(truth.pose.wheelbase) + 2 * r
        depths = _run_over(_depth, NEWTON, (drawn.params, drawn.shape, truth.pose))
        shallow = depths <= np.asarray(depth_allowed(size.astype(dtype)), float)
        wrong &= ~(hollow & shallow)
    return Differences(torque, contact, wrong)


def _margin(truth: Equilibrium, weight: np.ndarray, r: np.ndarray) -> np.ndarray:
    """The least distance of a pose from another status [-]."""
    forces = truth.N_rear, truth.N_front, truth.grip_rear, truth.grip_front
    margins = [np.asarray(v) / weight for v in forces]
    margins += [np.asarray(v) / r for v in (truth.clearance, truth.wheel_clearance)]
    return np.min(np.abs(margins), axis=0)


def errors(sample: Sample, solver: PoseSolver, dtype: str) -> Differences:
    """Differences of a setting from the reference, whose own rounding counts as the setting's."""
    answers = answers_of(solver, sample.drawn, dtype)
    off = differences(sample.drawn, sample.truth, answers, solver, dtype)
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
        "held_out": int(np.sum(np.isfinite(held_out.torque))),
        "held_out_over": int(np.sum(exceeded)),
        "held_out_wrong": int(np.sum(held_out.wrong)),
    }


def answers_of(solver: PoseSolver, drawn: Drawn, dtype: str = "float64") -> Equilibrium:
    """A solver's answers to all poses."""
    return _run_over(_answer, solver, drawn, dtype)


def _answer(solver: PoseSolver, params: UGVParams, shape, x, angles) -> Equilibrium:
    return equilibrium(params, Track(shape, 0.0, 1.0), x, angles, FRICTION, solver=solver)


def _depth(solver: PoseSolver, params: UGVParams, shape, placed: Pose) -> jax.Array:
    """Depth to which the ground enters a wheel of a pose [m]."""
    track, r = Track(shape, 0.0, 1.0), params.wheel_radius
    wheels = placed.rear, placed.front
    return jnp.maximum(*(penetration(track, wheel, r, solver.samples) for wheel in wheels))


def _run_over(function, solver: PoseSolver, arguments, dtype: str = "float64"):
    """The function of a solver and each row of the arguments, in blocks, as NumPy arrays."""
    arguments = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), arguments)
    return jax.tree.map(np.asarray, _mapped(function, solver, tuple(arguments)))


@partial(jax.jit, static_argnums=(0, 1))
def _mapped(function, solver: PoseSolver, rows):
    return jax.lax.map(lambda row: function(solver, *row), rows, batch_size=BLOCK)
