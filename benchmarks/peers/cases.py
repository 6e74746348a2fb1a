"""The two walks that every program is given, their reference, and how a program is timed."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate

DURATION = 0.79
"""Of the walk [s]: from rest at pi/2 to just before the exchange of support."""
SAMPLES = 10
"""Evenly spread instants at which the crank's angle is compared, the end among them."""
TORQUE = 1.0
"""Of the motor [N m]."""
SPREAD = (0.985, 1.005)
"""Torques of a batch [N m]: its members slip and stop at other instants."""
BOUNDS = (1e-2, 1e-4, 1e-6)
"""Accuracies asked for: largest error of the crank's angle over the samples [rad]."""


@dataclass(frozen=True)
class Case:
    """A walk of one step under a constant torque: on grip, or sliding once and stopping again."""

    name: str
    friction: float | None

    @property
    def scene(self) -> Scene:
        """The floor; only the motion is asked for."""
        if self.friction is None:
            return Scene.grip(outputs="state")
        return Scene.uniform(self.friction, self.friction, outputs="state")


CASES = (Case("stick", None), Case("stick-slip", 0.4))


def error_of(angles: Any, wanted: Any) -> float:
    """Largest difference of crank angles [rad]; infinite where a program gave no number."""
    gap = np.abs(np.asarray(angles, float) - np.asarray(wanted, float))
    return float(np.max(np.where(np.isfinite(gap), gap, np.inf)))


@lru_cache
def reference(case: Case, torques: tuple[float, ...] = (TORQUE,), steps: int = 7900) -> np.ndarray:
    """Crank angles [torques, SAMPLES] with exact inertia functions in float64 and tiny steps.

    Needs 64 bits switched on. Halving the steps moves it by less than 1e-10 rad.
    """
    if jnp.zeros(()).dtype != np.float64:
        raise ValueError("the reference needs 64 bits: jax.config.update('jax_enable_x64', True)")
    params = BipedParams.from_bars(dtype=np.float64)

    def walk(torque):
        path = simulate(params, case.scene, BipedState(), torque, DURATION, DURATION / steps)
        return path.states.crank_angle[steps // SAMPLES :: steps // SAMPLES]

    return np.asarray(jnp.stack([walk(jnp.asarray(torque)) for torque in torques]))


def measured(
    program: str,
    case: Case,
    setting: str,
    run: Callable[[], Any],
    repeats: int,
    *,
    batch: int = 1,
    walks: int | None = None,
) -> dict[str, Any]:
    """Error of the first and the last walk, and simulated seconds a wall and a core-second.

    run: returns crank angles [walks, SAMPLES]. walks: their number, where it returns fewer. The
    wall rate is of the fastest run, the core rate of the median one, of up to a second of runs.
    """
    angles = np.atleast_2d(np.asarray(run()))
    wanted = reference(case, SPREAD) if batch > 1 else reference(case)
    error = error_of(angles[[0, -1]], wanted)
    seconds: list[float] = []
    core: list[float] = []
    while len(seconds) < repeats and (not seconds or sum(seconds) + seconds[-1] <= 1.0):
        begun, before = time.perf_counter(), time.process_time()
        run()
        core.append(time.process_time() - before)
        seconds.append(time.perf_counter() - begun)
    simulated = (walks or len(angles)) * DURATION
    return {
        "program": program,
        "case": case.name,
        "setting": setting,
        "batch": batch,
        "error": error if np.isfinite(error) else None,
        "rate": simulated / min(seconds),
        "core_rate": simulated / max(float(np.median(core)), 1e-9),
    }
