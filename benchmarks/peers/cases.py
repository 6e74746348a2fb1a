"""The two walks that every program is given, their reference, and what a measurement is."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, simulate

DURATION = 0.79
"""Of the walk [s]: from rest at pi/2 to just before the exchange of support."""
SAMPLES = 10
"""Instants, evenly spread and with the end among them, at which the crank's angle is compared."""
TORQUE = 1.0
"""Of the motor [N m]."""
SPREAD = (0.985, 1.005)
"""Torques of a batch [N m]: so that the feet of its members slip and stop at other instants."""
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


@dataclass(frozen=True)
class Measured:
    """One setting of one program on one case.

    error: largest over the samples [rad]. rate: simulated seconds a wall second, the best of the
    repeats, slowest beside it; core_rate: a second of processor time, all threads summed, their
    median, which other work on the machine hardly moves. build: seconds before the first run,
    compilation included.
    """

    program: str
    case: str
    setting: str
    batch: int
    threads: int
    error: float
    rate: float
    slowest: float
    core_rate: float
    build: float
    note: str = ""

    def row(self) -> dict[str, Any]:
        """As a dictionary that JSON can hold."""
        finite = self.error if np.isfinite(self.error) else None
        return {**asdict(self), "error": finite}


@dataclass
class Timing:
    """Wall seconds and seconds of processor time of repeated runs."""

    seconds: list[float] = field(default_factory=list)
    core_seconds: list[float] = field(default_factory=list)

    def rates(self, simulated: float) -> dict[str, Any]:
        """Measured's rate, slowest and core_rate for so many simulated seconds a run."""
        return {
            "rate": simulated / min(self.seconds),
            "slowest": simulated / max(self.seconds),
            "core_rate": simulated / max(float(np.median(self.core_seconds)), 1e-9),
        }


def load(module: str) -> Any:
    """An optional package, imported where it is needed; type checkers know little of these."""
    return import_module(module)


def timed(run: Callable[[], Any], repeats: int, budget: float = 4.0) -> Timing:
    """Up to `repeats` runs, at least one, as many as fit `budget` [s]. `run` ends when its work is
    done, and has run before."""
    taken = Timing()
    for _ in range(repeats):
        begun, before = time.perf_counter(), time.process_time()
        run()
        taken.core_seconds.append(time.process_time() - before)
        taken.seconds.append(time.perf_counter() - begun)
        if sum(taken.seconds) + taken.seconds[-1] > budget:
            break
    return taken


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

    angles = jnp.stack([walk(jnp.asarray(torque)) for torque in torques])
    return np.asarray(angles)


def ends(case: Case, batch: int) -> np.ndarray:
    """The reference of a batch's first and last member, or of a single walk."""
    return reference(case, SPREAD) if batch > 1 else reference(case)


def measured(
    program: str,
    case: Case,
    setting: str,
    run: Callable[[], Any],
    repeats: int,
    build: float,
    *,
    batch: int = 1,
    threads: int = 1,
    walks: int | None = None,
) -> Measured:
    """Run once for the error of the first and the last walk, then for the time, about a second.

    run: gives crank angles [walks, SAMPLES]. walks: how many it takes, where it gives fewer.
    """
    angles = np.atleast_2d(np.asarray(run()))
    error = error_of(angles[[0, -1]], ends(case, batch))
    taken = timed(run, repeats, 1.0)
    rates = taken.rates((walks or len(angles)) * DURATION)
    return Measured(program, case.name, setting, batch, threads, error, build=build, **rates)


def check_reference(path: Path) -> dict[str, float]:
    """Our crank angle at the end of the first trajectory of a file of reference values, and its."""
    told = json.loads(path.read_text(encoding="utf-8"))["trajectories"][0]
    end = told["t_end"]
    scene = Scene.uniform(told["mu_static"], told["mu_kinetic"], outputs="state")
    run = partial(simulate, BipedParams.from_bars(dtype=np.float64), scene)
    state = BipedState(phase=told["theta0"], crank_rate=told["omega0"])
    found = run(state, told["torque"], end, end / 7900, integrator=RK4Split()).final.crank_angle
    return {"ours": float(found), "file": told["theta"], "difference": float(found) - told["theta"]}


def fastest(rows: list[Measured], bound: float) -> Measured | None:
    """The measurement that meets `bound` with the least processor time."""
    meet = (row for row in rows if row.error <= bound)
    return max(meet, key=lambda row: row.core_rate * row.threads, default=None)
