"""MuJoCo's C engine on the mechanism of mjcf.py, by its own `rollout`: no Python in the loop."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from benchmarks.peers.cases import DURATION, SAMPLES, SPREAD, TORQUE, Case, Measured, load, measured
from benchmarks.peers.mechanism import Mechanism, mechanism
from benchmarks.peers.mjcf import CRANK_JOINT, Settings, mjcf
from stickslip.dynamics.biped import BipedParams

NAME = "MuJoCo"

# integrator and time constant of the constraints in timesteps. RK4 is stable down to 0.5 and, the
# more so the softer, of second order; contacts chatter below 1.
FAMILIES = {
    "stick": (("RK4", 0.5), ("RK4", 1.0), ("Euler", 2.0), ("discrete", 2.0)),
    "stick-slip": (("RK4", 1.0), ("RK4", 2.0), ("Euler", 2.0), ("discrete", 2.0)),
}
STEPS = (200, 400, 800, 1600, 3200, 6400, 12800)
"""Timesteps of a walk."""


class Engine:
    """A compiled model and what a run of it needs."""

    def __init__(self, case: Case, settings: Settings, threads: int = 1):
        mujoco, begun = load("mujoco"), time.perf_counter()
        self.model = mujoco.MjModel.from_xml_string(mjcf(_machine(), settings, case.friction))
        self.data = [mujoco.MjData(self.model) for _ in range(threads)]
        self.steps = round(DURATION / settings.timestep)
        whole = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.initial = np.zeros(mujoco.mj_stateSize(self.model, whole))
        mujoco.mj_getState(self.model, self.data[0], self.initial, whole)
        self.crank = 1 + int(self.model.joint(CRANK_JOINT).qposadr[0])  # after the time
        self.build = time.perf_counter() - begun

    def run(self, torques: np.ndarray) -> np.ndarray:
        """Crank angles [batch, SAMPLES] under constant torques [batch], one thread a data."""
        shape = (len(torques), self.steps, 1)
        control = np.broadcast_to(torques[:, None, None], shape)
        initial = np.broadcast_to(self.initial, (len(torques), len(self.initial)))
        states, _ = load("mujoco.rollout").rollout(self.model, self.data, initial, control)
        every = self.steps // SAMPLES
        return _machine().crank_angle + states[:, every - 1 :: every, self.crank]


def measure(case: Case, quick: bool) -> Iterator[Measured]:
    """Every family of settings from coarse to fine, one core; the fastest with two threads."""
    best: tuple[float, Settings] | None = None
    for integrator, ratio in FAMILIES[case.name]:
        for steps in STEPS[: 5 if quick else None]:
            timestep = DURATION / steps
            settings = Settings(timestep, integrator, (ratio * timestep, 1.0))
            row = _measure(case, settings, quick)
            yield row
            if row.error <= 1e-2 and (best is None or row.core_rate > best[0]):
                best = row.core_rate, settings
    if case.friction is not None:
        for steps in STEPS[1 : 3 if quick else 5]:
            timestep = DURATION / steps
            harder = Settings(timestep, "RK4", (timestep, 1.0))
            yield _measure(case, replace(harder, impratio=100.0), quick)
            yield _measure(case, replace(harder, noslip_iterations=10), quick)
    if best is not None:
        yield _measure(case, best[1], quick, batch=16, threads=2)


def _measure(
    case: Case, settings: Settings, quick: bool, batch: int = 1, threads: int = 1
) -> Measured:
    engine = Engine(case, settings, threads)
    torques = np.array([TORQUE]) if batch == 1 else np.linspace(*SPREAD, batch)
    return measured(
        NAME,
        case,
        describe(settings),
        partial(engine.run, torques),
        2 if quick else 5,
        engine.build,
        batch=batch,
        threads=threads,
    )


def describe(settings: Settings) -> str:
    """The settings in a few words."""
    words = [settings.integrator, f"{1e3 * settings.timestep:.3g} ms"]
    words.append(f"solref {settings.solref[0] / settings.timestep:.2g} steps")
    if settings.impratio != 1:
        words.append(f"impratio {settings.impratio:g}")
    if settings.noslip_iterations:
        words.append(f"{settings.noslip_iterations} noslip iterations")
    return ", ".join(words)


@lru_cache
def _machine() -> Mechanism:
    return mechanism(BipedParams.from_bars(dtype=np.float64))
