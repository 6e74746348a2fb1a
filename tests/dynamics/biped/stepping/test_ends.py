"""Walks of random robots end where scipy finds it.

The reference writes the equations of MODEL 1.4 and the switching out again; it shares the table of
inertia functions with the walk, and nothing else.
"""

from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    BipedState,
    EventExact,
    RK4Split,
    floor_position,
    own_time,
    prepare,
)
from stickslip.dynamics.biped.contact import Torque
from stickslip.dynamics.biped.simulation import stepped

pytestmark = pytest.mark.long

WALKS, DRAWN = 100, 160
SCREENED = 2000
"""Walks drawn for the rarest end, which most fast slides do not live to see."""
PERIODS = 60
"""Control periods of 20 ms, of the default robot, that a walk is followed for at most."""
EXACT = EventExact(max_steps=512)
ENDS = {
    "lift-off": Status.LIFT_OFF,
    "topple": Status.TOPPLE,
    "runaway": Status.RUNAWAY,
    "no solution": Status.NO_SOLUTION,
}


class Drawn(NamedTuple):
    """Random walks, [n] each."""

    model: Any
    state: BipedState
    torque: Any
    mu_static: Any
    mu_kinetic: Any
    max_rate: Any
    period: Any


@cache
def drawn(kind: str) -> Drawn:
    """Walks of random robots, most of which end in the given way."""
    random, lost = np.random.default_rng(list(ENDS).index(kind)), kind == "no solution"
    n = SCREENED if lost else DRAWN
    times = lambda value, factor: value * factor ** random.uniform(-1, 1, n)  # noqa: E731
    bars = {
        "crank_length": np.exp(random.uniform(np.log(0.01), np.log(0.3), n)),
        "bar_density": times(1.48, 4.0),
        "hip_mass": times(0.70, 4.0),
        "foot_mass": times(0.30, 4.0),
        "gravity": times(9.81, 2.5),
    }
    params = BipedParams.from_bars(**{k: jnp.asarray(v) for k, v in bars.items()}, dtype=float)
    time, length = np.asarray(own_time(params)), np.asarray(params.crank)
    torque = {"lift-off": (0.2, 1.5), "topple": (0.3, 0.8)}.get(kind, (-0.1, 0.4))
    rates = {"lift-off": (0.3, 0.6), "topple": (0.0, 0.2)}.get(kind, (0.1, 0.3))
    friction, velocities, share = (0.1, 0.6), (-0.5, 0.5), 0.5
    if lost:  # fast backward slides, where the equations lose their solution at some phases
        friction, velocities, share = (2.0, 4.0), (-9.0, -1.0), 1.0
        rates, torque = (-0.3, 0.6), (-0.8, 1.0)
    still = random.uniform(*friction, n)
    rate = random.uniform(*rates, n) / time
    slides = random.uniform(size=n) < share
    velocity = random.uniform(*velocities, n) * slides * length / time
    moment = np.asarray(params.total_mass) * np.asarray(params.gravity) * length
    most = (0.35 if kind == "runaway" else 1e6) / time
    zero, steps = jnp.zeros(n), jnp.zeros(n, jnp.int32)
    phase = jnp.asarray(random.uniform(SUPPORT_START, SUPPORT_END, n))
    state = BipedState(phase, steps, jnp.asarray(rate), zero, jnp.asarray(velocity), zero)
    numbers = (random.uniform(*torque, n) * moment, still, still * random.uniform(0.6, 1, n), most)
    period = 0.02 * time / float(own_time(BipedParams.from_bars()))
    model = prepare(params, fidelity="table")
    walks = Drawn(model, state, *map(jnp.asarray, (*numbers, period)))
    return screened(walks) if lost else walks


def screened(walks: Drawn) -> Drawn:
    """The first DRAWN walks that coarse steps lose the solution of, on the way."""
    state, status = ends(RK4Split(), "state", walks, jnp.asarray(4))
    late = (np.asarray(status) == Status.NO_SOLUTION) & (np.asarray(state.time) > 0)
    return jax.tree.map(lambda leaf: leaf[np.flatnonzero(late)[:DRAWN]], walks)


def followed(spec, outputs: str, walk: Drawn, parts):
    """Where a walk ends in steps of its period over `parts`, and its status."""
    scene = Scene.uniform(walk.mu_static, walk.mu_kinetic, outputs=outputs)
    size = walk.period / parts

    def body(_, carry):
        state, status = carry
        call = spec, "table", walk.model, scene, state, Torque(walk.torque), size
        after, contact = stepped(*call, walk.max_rate)
        over, new = status > Status.SLIP_ONSET, (after, contact.status)
        return jax.tree.map(lambda a, b: jnp.where(over, a, b), (state, status), new)

    return jax.lax.fori_loop(0, PERIODS * parts, body, (walk.state, jnp.zeros((), jnp.int32)))


@partial(jax.jit, static_argnums=(0, 1))
def ends(spec, outputs: str, walks: Drawn, parts):
    return jax.vmap(lambda walk: followed(spec, outputs, walk, parts))(walks)


def ended(kind: str, spec, parts: int):
    outputs = "forces" if kind == "topple" else "state"
    state, status = ends(spec, outputs, drawn(kind), jnp.asarray(parts))
    return jax.tree.map(np.asarray, state), np.asarray(status)


@cache
def chosen(kind: str) -> np.ndarray:
    """The walks that end as they should, and not at once."""
    state, status = ended(kind, EXACT, 1)
    return np.flatnonzero((status == ENDS[kind]) & (state.time > 0))[:WALKS]


class Reference:
    """One walk by scipy: legs of one mode each, with events at their ends."""

    def __init__(self, walks: Drawn, index: int, judged: bool):
        pick = lambda tree: jax.tree.map(lambda leaf: np.asarray(leaf)[index], tree)  # noqa: E731
        model = walks.model
        self.tables = np.asarray(pick(model.fitted.momenta)), np.asarray(pick(model.fitted.moments))
        self.mass, self.gravity = float(pick(model.total_mass)), float(pick(model.gravity))
        self.toe, self.heel = float(pick(model.toe)), float(pick(model.heel))
        self.torque, self.period = float(walks.torque[index]), float(walks.period[index])
        self.still, self.sliding = float(walks.mu_static[index]), float(walks.mu_kinetic[index])
        self.most, self.judged = float(walks.max_rate[index]), judged
        self.begin = pick(walks.state)

    def look_up(self, table: np.ndarray, theta: float):
        pieces = len(table)
        place = (theta - SUPPORT_START) * pieces / np.pi
        piece = int(np.clip(np.floor(place), 0, pieces - 1))
        u, powers = 2 * (place - piece) - 1, np.arange(table.shape[-1])
        slopes = table[piece][:, 1:] @ (powers[1:] * u ** powers[:-1]) * 2 * pieces / np.pi
        return table[piece] @ u**powers, slopes

    def motion(self, mode: int, theta: float, rate: float):
        """alpha, a1, f, N and what is left of solvability."""
        (M, P, Y), (dM, dP, dY) = self.look_up(self.tables[0], theta)
        m, g = self.mass, self.gravity
        crank = self.torque - dM * rate**2 / 2 - g * Y
        if mode == 0:
            alpha = crank / M
            return alpha, 0.0, P * alpha + dP * rate**2, m * g + Y * alpha + dY * rate**2, 1.0
        signed = mode * self.sliding
        matrix = np.array([[M, P], [P + signed * Y, m]])
        right = [crank, -dP * rate**2 - signed * (m * g + dY * rate**2)]
        alpha, a1 = np.linalg.solve(matrix, right)
        normal = m * g + Y * alpha + dY * rate**2
        return alpha, a1, -signed * normal, normal, np.linalg.det(matrix)

    def margins(self, mode: int, theta: float, rate: float) -> list[float]:
        """Of the ends, in the order of ENDS."""
        alpha, a1, _, normal, left = self.motion(mode, theta, rate)
        edge = 1.0
        if self.judged:
            (L, X, Y), (dL, _, _) = self.look_up(self.tables[1], theta)
            moment = L * alpha + dL * rate**2 + self.gravity * X - a1 * Y
            edge = min(self.toe * normal - moment, self.heel * normal + moment)
        return [normal, edge, self.most - abs(rate), left]

    def leg(self, mode: int, y: list[float], until: float):
        """One mode from y = (theta, rate, slide, velocity), and what ends it."""

        def slope(_, y):
            alpha, a1, *_ = self.motion(mode, y[0], y[1])
            return [y[1], alpha, y[3], a1]

        def change(_, y):
            if mode:
                return mode * y[3]
            _, _, friction, normal, _ = self.motion(0, y[0], y[1])
            return self.still * normal - abs(friction)

        events = [lambda _, y, i=i: self.margins(mode, y[0], y[1])[i] for i in range(len(ENDS))]
        events += [change, lambda _, y: y[0] - SUPPORT_END, lambda _, y: SUPPORT_START - y[0]]
        for event in events:
            event.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
        for event, way in zip(events, [-1] * 5 + [1] * 2, strict=True):
            event.direction = way  # pyright: ignore[reportFunctionMemberAccess]
        settings = {"rtol": 1e-11, "atol": 1e-13, "max_step": self.period / 8}
        return solve_ivp(slope, (0.0, until), y, method="DOP853", events=events, **settings)

    def end(self) -> tuple[float, str]:
        now, slips, state = 0.0, 0, self.begin
        y = [float(v) for v in (state.phase, state.crank_rate, 0.0, state.foot_velocity)]
        while now < PERIODS * self.period:
            mode = int(np.sign(y[3])) or slips
            if not mode:
                _, _, friction, normal, _ = self.motion(0, y[0], y[1])
                mode = 0 if abs(friction) <= self.still * normal else -int(np.sign(friction))
            for kind, margin in zip(ENDS, self.margins(mode, y[0], y[1]), strict=True):
                if margin <= 0:
                    return now, kind
            y[3] = y[3] or 1e-12 * mode  # or a short slide would end where it begins
            found = self.leg(mode, y, PERIODS * self.period - now)
            now, y, slips = now + found.t[-1], list(found.y[:, -1]), 0
            hit = [i for i, times in enumerate(found.t_events) if len(times)]
            if not hit:
                break
            if hit[0] < len(ENDS):
                return now, list(ENDS)[hit[0]]
            if hit[0] == len(ENDS):
                slips = 0 if mode else -int(np.sign(self.motion(0, y[0], y[1])[2]))
                y[3] = 0.0
            else:
                y[0] = SUPPORT_START if hit[0] == len(ENDS) + 1 else SUPPORT_END
        return now, "none"


@cache
def by_scipy(kind: str) -> list[tuple[float, str]]:
    """Instants and kinds of the first walks' ends."""
    return [Reference(drawn(kind), i, kind == "topple").end() for i in chosen(kind)[:25]]


@pytest.mark.parametrize("kind", ENDS)
@pytest.mark.parametrize(("spec", "parts", "tolerance"), [(EXACT, 1, 1e-6), (RK4Split(), 16, 1e-5)])
def test_scipy_finds_the_same_end(float64, kind, spec, parts, tolerance):
    """tolerance: of the time, in control periods."""
    if kind == "no solution" and parts > 1:  # forces grow without bound towards it
        parts, tolerance = 64, 1e-4
    use, (state, status) = chosen(kind)[:25], ended(kind, spec, parts)
    times, kinds = zip(*by_scipy(kind), strict=True)
    off = np.abs(times - state.time[use]) / np.asarray(drawn(kind).period)[use]
    same = np.array([name == kind for name in kinds]) & (status[use] == ENDS[kind])
    print(f"\nends {kind} beside scipy: {len(use)} walks, {np.sum(~same)} end otherwise")
    assert np.mean(same & (off < tolerance)) > 0.9


@partial(jax.jit, static_argnums=(0, 1))
def slopes(spec, outputs: str, walks: Drawn):
    """The end's time and place by torque and crank rate, forwards; time and place."""

    def one(walk: Drawn):
        def end(torque, rate):
            state = BipedState(**(vars(walk.state) | {"crank_rate": rate}))
            last, _ = followed(spec, outputs, walk._replace(torque=torque, state=state), 1)
            place = floor_position(walk.model, last)
            return jnp.stack([last.time, last.crank_angle, place, last.crank_rate])

        at = walk.torque, walk.state.crank_rate
        return jnp.stack(jax.jacfwd(end, (0, 1))(*at)), end(*at)

    return jax.vmap(one)(walks)


@pytest.mark.parametrize("kind", ENDS)
def test_derivatives_of_an_end_are_those_that_differences_show(float64, kind):
    """Central differences; walks where those over half the distance disagree are left out."""
    step, least = (1e-6, 0.5) if kind == "no solution" else (1e-5, 0.7)  # unbounded ends
    spec, outputs = EventExact(max_steps=64), "forces" if kind == "topple" else "state"
    use = chosen(kind)[:40]
    walks = jax.tree.map(lambda leaf: leaf[use], drawn(kind))
    ahead, _ = slopes(spec, outputs, walks)
    values = {"torque": walks.torque, "crank_rate": walks.state.crank_rate}
    for i, (name, value) in enumerate(values.items()):
        ahead_by, shift, found = np.asarray(ahead[:, i]), step * np.abs(value), []
        for scale in (1.0, 0.5):
            at = {}
            for k in (-2, -1, 1, 2):
                moved = value + k * scale * shift
                state = BipedState(**(vars(walks.state) | {"crank_rate": moved}))
                changed = walks._replace(torque=moved) if i == 0 else walks._replace(state=state)
                at[k] = np.asarray(slopes(spec, outputs, changed)[1])
            difference = 8 * (at[1] - at[-1]) - (at[2] - at[-2])
            found.append(difference / (12 * scale * np.asarray(shift))[:, None])
        size = np.max(np.abs(found[1]), axis=1, keepdims=True)
        scatter = np.max(np.abs(found[0] - found[1]) / np.abs(found[1]).clip(1e-3 * size), axis=1)
        off = np.max(np.abs(ahead_by - found[1]) / np.abs(found[1]).clip(1e-3 * size), axis=1)
        sound = scatter < 1e-4
        print(
            f"\nderivatives of {kind} by {name}: {np.sum(sound)} of {len(use)} walks, median "
            f"{np.median(off[sound]):.1e}, most {off[sound].max():.1e}"
        )
        assert np.sum(sound) > least * len(use)
        assert np.mean(off[sound] < 1e-3) > 0.95
