"""Seeded walks of every kind: robots, floors, starts and torques drawn at random.

Walk number i is drawn from a generator of its own, seeded by i alone, so that any of them can be
had again. Everything is drawn in the robot's own units and scaled: lengths in crank lengths, times
in sqrt(crank / gravity), torques in weight times crank. In brackets: what that is for the default
robot.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedParams, BipedState
from stickslip.dynamics.biped.params import own_time

DEFAULT_LENGTH = 0.030
"""Crank of the default robot [m]."""
DEFAULT_TIME = float(np.sqrt(DEFAULT_LENGTH / 9.81))
"""Its own time [s]."""
PERIOD = 0.02 / DEFAULT_TIME
"""The torque is held for this long, in own times [20 ms]."""
PERIODS = 100
"""Control periods of a walk [2 s]."""
FLOORS = ("smooth", "stick-slip", "ice")
ROBOTS = ("default", "others")
HELD_OUT = 10**6
"""Walks are measured with the seeds from 0, promises are tested with those from here."""
STEP = 8.0
"""Length of a step in crank lengths."""
EDGES = 4


class Walks(NamedTuple):
    """A batch of walks in SI units, one row each."""

    params: BipedParams
    scene: Scene
    state: BipedState
    law: tuple[Any, Any, Any]
    """Gain [N m s], wanted rate [rad/s], torques [n, PERIODS] added in each control period."""
    period: Any
    """[s]"""
    seeds: Any


def both(floor: str, seeds) -> Walks:
    """The walks of these seeds, first with the default robot, then with robots at random."""
    one, other = (draw(floor, seeds, robots) for robots in ROBOTS)
    return jax.tree.map(lambda a, b: np.concatenate([a, b]), one, other)


def draw(floor: str, seeds, robots: str) -> Walks:
    """The walks of these seeds on one kind of floor, in float64: call it with x64 on.

    robots: "default" for the default robot, "others" for one of each walk's own.
    """
    drawn = [_one(floor, int(seed), robots) for seed in seeds]
    columns = {name: np.asarray([one[name] for one in drawn]) for name in drawn[0]}
    bars = ("crank_length", "bar_density", "hip_mass", "foot_mass", "payload", "gravity")
    given: dict[str, Any] = {name: jnp.asarray(columns[name]) for name in bars}
    params = BipedParams.from_bars(**given, dtype=jnp.float64)
    length, time = np.asarray(params.crank), own_time(params)
    moment = np.asarray(params.total_mass) * np.asarray(params.gravity) * length
    zero = jnp.zeros(len(drawn))
    state = BipedState(
        phase=jnp.asarray(columns["phase"]),
        steps=jnp.zeros(len(drawn), jnp.int32),
        crank_rate=jnp.asarray(columns["rate"] / time),
        foot_position=zero,
        foot_velocity=jnp.asarray(columns["velocity"] * length / time),
        time=zero,
    )
    law = (
        jnp.asarray(columns["gain"] * moment * time),
        jnp.asarray(columns["wanted"] / time),
        jnp.asarray(columns["torques"] * moment[:, None]),
    )
    period = jnp.asarray(PERIOD * time)
    return Walks(params, _floor(floor, columns, length), state, law, period, np.asarray(seeds))


def _floor(floor: str, columns: dict[str, np.ndarray], length) -> Scene:
    if floor == "smooth":
        return Scene.grip(outputs="state")
    still, sliding = (jnp.asarray(columns[name]) for name in ("mu_static", "mu_kinetic"))
    if floor == "stick-slip":
        return Scene.uniform(still, sliding, outputs="state")
    edges = jnp.asarray(columns["edges"] * length[:, None])
    return Scene.patches(edges, still, sliding, outputs="state")


def _one(floor: str, seed: int, robots: str) -> dict[str, Any]:
    """Everything about one walk, as numbers in own units."""
    rng = np.random.default_rng(seed)
    found = _robot(rng)
    if robots == "default":
        found = dict(DEFAULT)
    slips = floor != "smooth" and rng.random() < 0.5
    found |= {
        "phase": rng.uniform(SUPPORT_START, SUPPORT_END),
        "rate": rng.uniform(-0.1, 0.4),  # [-1.8 to 7.2 rad/s]
        "velocity": rng.uniform(-0.5, 0.5) * slips,  # [0.27 m/s]
    }
    return found | _law(rng) | _friction(floor, rng)


DEFAULT = {
    "crank_length": 0.030,
    "bar_density": 1.48,
    "hip_mass": 0.70,
    "foot_mass": 0.30,
    "payload": 0.0,
    "gravity": 9.81,
}


def _robot(rng) -> dict[str, float]:
    def times(value: float, factor: float) -> float:
        return value * float(np.exp(rng.uniform(-1, 1) * np.log(factor)))

    return {
        "crank_length": float(np.exp(rng.uniform(np.log(0.01), np.log(0.3)))),
        "bar_density": times(1.48, 4.0),
        "hip_mass": times(0.70, 4.0),
        "foot_mass": times(0.30, 4.0),
        "payload": float(rng.uniform(0, 10)) * (rng.random() < 0.5),
        "gravity": times(9.81, 2.5),
    }


def _law(rng) -> dict[str, Any]:
    """A proportional controller, one torque all along, or torques at random."""
    kind = int(rng.integers(3))
    gain, wanted, torques = 0.0, 0.0, np.zeros(PERIODS)
    if kind == 0:
        gain, wanted = rng.uniform(1.5, 11.0), rng.uniform(0.05, 0.35)  # [0.2 to 1.5, 0.9 to 6.3]
    elif kind == 1:
        torques = np.full(PERIODS, rng.uniform(-0.1, 0.25))  # [-0.25 to 0.62 N m]
    else:
        held = int(rng.integers(1, 6))
        torques = np.repeat(rng.uniform(-0.4, 0.5, PERIODS), held)[:PERIODS]  # [-1 to 1.25 N m]
    return {"gain": gain, "wanted": wanted, "torques": torques}


def _friction(floor: str, rng) -> dict[str, Any]:
    if floor == "smooth":
        return {}
    share = rng.uniform(0.6, 1.0)
    if floor == "stick-slip":
        still = float(np.exp(rng.uniform(np.log(0.02), np.log(0.5))))
        return {"mu_static": still, "mu_kinetic": share * still}
    edges = np.cumsum(rng.uniform(0.1, 1.5, EDGES)) - 0.5  # in steps
    still = np.where(
        np.arange(EDGES + 1) % 2 == 0,
        rng.uniform(0.2, 0.6, EDGES + 1),
        np.exp(rng.uniform(np.log(0.01), np.log(0.1), EDGES + 1)),
    )
    return {"edges": STEP * edges, "mu_static": still, "mu_kinetic": share * still}
