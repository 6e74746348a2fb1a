"""100,000 random vehicles on random ground: every number marked, every OK one true."""

from collections import Counter
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from stickslip.dynamics.ugv.ground.spline import Spline
from stickslip.dynamics.ugv.poses import stand
from stickslip.dynamics.ugv.statics import balance
from stickslip.dynamics.ugv.wheel import size_near

pytestmark = pytest.mark.long

COUNT = 100_000
BATCH = 500
SOLVERS = (PoseSolver(), PoseSolver(iterations=3, samples=8))
CASES = (*((kind, solver) for kind in ("points", "table") for solver in SOLVERS),
         *((kind, SOLVERS[0]) for kind in ("even table", "step", "sinusoid")))  # fmt: skip
"""Kinds of ground with solvers: points and tables share a compiled program for each solver."""
KNOTS = 40


def vehicles(random: np.random.Generator, size: np.ndarray) -> UGVParams:
    """Of about `size` [m] each, of any proportions that fold."""
    n = len(size)
    low = random.uniform(0.0, 1.5, n)
    leg = size * random.uniform(0.1, 1.0, n)
    body = 2 * leg * np.cos(low) * 1.001 + size * random.uniform(0.01, 2.0, n)
    masses = 10 ** random.uniform(-2, 4, (3, n)) * (random.random((3, n)) > 0.1)
    masses[1] = np.where(np.all(masses == 0, axis=0), 1.0, masses[1])
    return UGVParams(
        body_length=body,
        leg_length=leg,
        wheel_radius=size * 10 ** random.uniform(-1.5, 0.0, n),
        wheel_mass=masses[0],
        body_mass=masses[1],
        leg_mass=masses[2],
        gravity=10 ** random.uniform(-1, 2, n),
        leg_angle_min=low,
        leg_angle_max=np.pi - low,
    )


def grounds(random: np.random.Generator, kind: str, away: np.ndarray, up, size) -> Track:
    """One for each vehicle, about `size` long in its features; a batch."""
    rough = size * 10 ** random.uniform(-3, 0, len(size))
    if kind == "step":
        made = [
            Track.step(h, a + s, s * w, start=a - s, end=a + 9 * s)
            for a, h, s, w in zip(away, rough, size, random.uniform(0.1, 3, len(size)), strict=True)
        ]
    elif kind == "sinusoid":
        made = [
            Track.sinusoid(h, s * w, start=a, end=a + 9 * s)
            for a, h, s, w in zip(away, rough, size, random.uniform(1, 9, len(size)), strict=True)
        ]
    else:
        made = [
            _through(random, kind, a, y, s, h)
            for a, y, s, h in zip(away, up, size, rough, strict=True)
        ]
    return jax.tree.map(lambda *leaves: np.stack([np.asarray(v) for v in leaves]), *made)


def _through(random, kind, away, up, size, rough) -> Track:
    x = away + np.cumsum(random.uniform(0.2, 1.0, KNOTS)) * size - 6 * size
    y = up + rough * random.normal(0, 1, KNOTS)
    interpolation = ("cubic", "pchip", "makima", "linear")[random.integers(4)]
    track = Track.from_points(x, y, interpolation)
    if kind != "points":
        track = track.resampled(float(x[0]), float(x[-1]), KNOTS - 1)
    shape = track.shape
    rows = np.zeros((KNOTS - 1, 6))
    rows[:, : shape.coefficients.shape[1]] = shape.coefficients
    padded = Spline(shape.knots, shape.rests, rows, shape.lows, even=kind == "even table")
    return Track(padded, track.start, track.end)


@partial(jax.jit, static_argnums=5)
def held(params, tracks, x, angles, friction, solver):
    def one(params, track, x, angles, friction):
        placed = stand(params, track, x, angles, solver)
        return balance(params, placed, friction)

    return jax.vmap(one)(params, tracks, x, angles, friction)


@jax.jit
def truths(params, tracks, x, rear):
    """Height and slope of the ground at the rear contact in float64, and what rounds there."""

    def one(params, track, x, rear):
        ground = track.seen_from(x)
        height, slope, second = ground.profile(rear)
        return height, slope, second, size_near(ground, jnp.zeros_like(x), params.wheel_radius)

    return jax.vmap(one)(params, tracks, x, rear)


def check(found, params, tracks, x) -> None:
    """What OK promises of forces and contact, worked out in NumPy in double precision."""
    ok = np.asarray(found.status) == Status.OK
    leaves = jax.tree.leaves(found)
    assert all(np.all(np.isfinite(np.asarray(leaf)[ok])) for leaf in leaves)
    eps = float(np.finfo(np.asarray(found.torque).dtype).eps)
    double = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), (found, params, tracks, x))
    found, params, tracks, x = double
    at = found.pose
    with jax.enable_x64(True):
        height, slope, second, size = map(np.asarray, truths(params, tracks, x, at.rear.x))
    size = size + at.wheelbase
    steep = 1 + np.abs(slope)
    # On the curve; each digit of x lost moves the ground by the slope, and the slope by f''.
    off = np.abs(at.rear.point[:, 1] - height) / (64 * eps * size * steep)
    assert np.max(off[ok], initial=0) < 1
    between = at.front.centre - at.rear.centre
    missed = np.abs(np.hypot(between[:, 0], between[:, 1]) - at.wheelbase)
    bent = 1 + params.wheel_radius * np.abs(second)
    assert np.max((missed / (256 * eps * size * steep * bent))[ok], initial=0) < 1
    # Equilibrium: forces and moments about the front contact, against all that is added up.
    forces = []
    for wheel, F, N in ((at.rear, found.F_rear, found.N_rear),
                        (at.front, found.F_front, found.N_front)):  # fmt: skip
        normal = np.stack([-wheel.tangent[:, 1], wheel.tangent[:, 0]], -1)
        forces.append(F[:, None] * wheel.tangent + N[:, None] * normal)
    g = params.gravity
    masses = ((params.wheel_mass, at.rear.centre), (params.wheel_mass, at.front.centre),
              (params.leg_mass, at.rear_leg), (params.leg_mass, at.front_leg),
              (params.body_mass, at.body))  # fmt: skip
    weight = sum(m for m, _ in masses) * g
    total = np.abs(forces[0]).sum(-1) + np.abs(forces[1]).sum(-1) + weight
    residual = forces[0] + forces[1] - np.stack([0 * weight, weight], -1)
    assert np.max((np.abs(residual).max(-1) / (1024 * eps * total))[ok], initial=0) < 1
    arm = at.rear.point - at.front.point
    turning = arm[:, 0] * forces[0][:, 1] - arm[:, 1] * forces[0][:, 0]
    pulled = sum(m * g * (c[:, 0] - at.front.point[:, 0]) for m, c in masses)
    moment = np.abs(turning - pulled) / (4096 * eps * total * size)
    assert np.max(moment[ok], initial=0) < 1


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_vehicles_on_random_ground(precision, capsys):
    random, counts, tried = np.random.default_rng(7), Counter(), 0
    rounds = -(-COUNT // (2 * BATCH * len(CASES)))
    with jax.enable_x64(precision == "float64"):
        for kind, solver in CASES:
            for _ in range(rounds):
                size = 10 ** random.uniform(-1, 1, BATCH)
                away = size * random.choice([0.0, 1.0], BATCH) * random.uniform(-1e3, 1e3, BATCH)
                up = random.uniform(-9e3, 9e3, BATCH)
                params = vehicles(random, size)
                tracks = grounds(random, kind, away, up, size)
                x = away + size * random.uniform(0, 6, BATCH)
                low = params.leg_angle_min[:, None]
                angles = low + (np.pi - 2 * low) * random.random((BATCH, 2))
                friction = random.uniform(0, 2, BATCH)
                given = (params, tracks, x, angles, friction)
                given = jax.tree.map(lambda leaf: jnp.asarray(leaf, precision), given)
                found = jax.block_until_ready(held(*given, solver))
                check(found, given[0], given[1], given[2])
                counts.update(Status(int(code)).name for code in np.asarray(found.status))
                tried += BATCH
            with capsys.disabled():
                print(f"\n{kind}, {solver}, {precision}: {dict(counts)} so far")
    with capsys.disabled():
        print(f"\n{tried} vehicles in {precision}: {dict(counts.most_common())}")
    assert counts["OK"] > 0.02 * tried
