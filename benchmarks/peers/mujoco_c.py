"""MuJoCo's C engine on the mechanism of mjcf.py, by its own `rollout`: no Python in the loop."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache, partial
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.peers.cases import DURATION, SAMPLES, TORQUE, Case, measured
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

    def __init__(self, case: Case, settings: Settings):
        mujoco: Any = import_module("mujoco")
        self.rollout = import_module("mujoco.rollout").rollout
        self.model = mujoco.MjModel.from_xml_string(mjcf(_machine(), settings, case.friction))
        self.data = [mujoco.MjData(self.model)]
        self.steps = round(DURATION / settings.timestep)
        whole = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.initial = np.zeros(mujoco.mj_stateSize(self.model, whole))
        mujoco.mj_getState(self.model, self.data[0], self.initial, whole)
        self.crank = 1 + int(self.model.joint(CRANK_JOINT).qposadr[0])  # after the time

    def run(self, torques: np.ndarray) -> np.ndarray:
        """Crank angles [batch, SAMPLES] under constant torques [batch]."""
        shape = (len(torques), self.steps, 1)
        control = np.broadcast_to(torques[:, None, None], shape)
        initial = np.broadcast_to(self.initial, (len(torques), len(self.initial)))
        states, _ = self.rollout(self.model, self.data, initial, control)
        every = self.steps // SAMPLES
        return _machine().crank_angle + states[:, every - 1 :: every, self.crank]


def measure(case: Case, quick: bool) -> Iterator[dict[str, Any]]:
    """Every family of settings from coarse to fine, on one core."""
    torque = np.array([TORQUE])
    for integrator, ratio in FAMILIES[case.name]:
        for steps in STEPS[: 3 if quick else None]:
            timestep = DURATION / steps
            settings = Settings(timestep, integrator, (ratio * timestep, 1.0))
            run = partial(Engine(case, settings).run, torque)
            yield measured(NAME, case, describe(settings), run, 2 if quick else 5)


def describe(settings: Settings) -> str:
    """The settings in a few words."""
    words = [settings.integrator, f"{1e3 * settings.timestep:.3g} ms"]
    words.append(f"solref {settings.solref[0] / settings.timestep:.2g} steps")
    return ", ".join(words)


@lru_cache
def _machine() -> Mechanism:
    return mechanism(BipedParams.from_bars(dtype=np.float64))
