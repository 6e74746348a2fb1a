"""Two walks, their reference, and how fast stickslip and MuJoCo simulate them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from importlib import import_module
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import times_of
from stickslip.agents.exchange.files import Settings, joint_of, mechanism, mjcf
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import SUPPORT_START, BipedParams, BipedState, prepare, simulate, step
from stickslip.dynamics.biped.settings import RK4Split, Table

DURATION = 0.79
"""Duration of the walk [s]: from rest at pi/2 to just before the exchange of support."""
SAMPLES = 10
"""Evenly spread instants at which the crank's angle is compared, the end among them."""
TORQUE = 1.0
"""Torque of the motor [N m]."""
SPREAD = (0.985, 1.005)
"""Torques of a batch [N m]: its members slip and stop at other instants."""
BOUNDS = (1e-2, 1e-4, 1e-6)
"""Accuracies asked for: largest error of the crank's angle over the samples [rad]."""


CASES: dict[str, float | None] = {"stick": None, "stick-slip": 0.4}
"""Frictions of the floors, of a walk of one step: on grip, or sliding once and stopping again."""


def scene_of(case: str) -> Scene:
    """The floor; only the motion is asked for."""
    mu = CASES[case]
    return Scene.grip(outputs="state") if mu is None else Scene.uniform(mu, mu, outputs="state")


def error_of(angles: Any, wanted: Any) -> float:
    """Largest difference of crank angles [rad]; infinite where a program gave no number."""
    gap = np.abs(np.asarray(angles, float) - np.asarray(wanted, float))
    return float(np.max(np.where(np.isfinite(gap), gap, np.inf)))


@lru_cache
def reference(case: str, torques: tuple[float, ...] = (TORQUE,)) -> np.ndarray:
    """Crank angles [torques, SAMPLES] with exact inertia functions in float64 and tiny steps.

    Under enable_x64. Halving the steps moves it by less than 1e-10 rad.
    """
    params, steps = BipedParams.from_bars(dtype=np.float64), 7900

    def walk(torque):
        path = simulate(params, scene_of(case), BipedState(), torque, DURATION, DURATION / steps)
        return path.states.crank_angle[steps // SAMPLES :: steps // SAMPLES]

    return np.asarray(jnp.stack([walk(jnp.asarray(torque)) for torque in torques]))


def measured(
    program: str, case: str, setting: str, run: Callable[[], Any], repeats: int, *, batch: int = 1
) -> dict[str, Any]:
    """Error of the first and the last walk, and simulated seconds a core-second.

    run: returns crank angles [walks, SAMPLES]. The rate is of the median run, of up to a second of
    runs.
    """
    angles = np.atleast_2d(np.asarray(run()))
    wanted = reference(case, SPREAD) if batch > 1 else reference(case)
    processor = np.median(times_of(run, repeats, longest=1.0)[:, 0])
    return {
        "program": program,
        "case": case,
        "setting": setting,
        "batch": batch,
        "error": error_of(angles[[0, -1]], wanted),
        "core_rate": len(angles) * DURATION / max(float(processor), 1e-9),
    }


BATCH = 4096
IN_A_ROW = 256
"""Walks that a call of batch 1 takes one after another, so that the call itself weighs nothing."""
PER_SAMPLE = (1, 2, 3, 4, 6, 8, 9, 12, 16, 20, 24, 32, 48)
"""Steps between two samples."""
CONFIGURATIONS = ((np.float32, Table(128, 3)), (np.float64, Table(32, 7)))


def stickslip_rows(case: str, quick: bool) -> Iterator[dict[str, Any]]:
    """One walk and a batch at every step size, in both precisions."""
    for batch in (1, BATCH):
        for dtype, table in CONFIGURATIONS:
            torques, walks = program(case, table, dtype, batch)
            for count in PER_SAMPLE[:4] if quick else PER_SAMPLE:
                length = DURATION / (SAMPLES * count)
                size = jnp.asarray(length, dtype), jnp.asarray(count, jnp.int32)
                setting = f"{np.dtype(dtype).name}, table {table.pieces}x{table.degree}, "
                setting += f"{1e3 * length:.3g} ms"
                run, repeats = partial(walks, torques, *size), 5 if quick else 10
                yield measured("stickslip", case, setting, run, repeats, batch=batch)


def program(case: str, table: Table, dtype: Any, batch: int):
    """Torques, and the compiled walks under them for any step size."""
    params = BipedParams.from_bars(dtype=dtype)
    model = jax.jit(partial(prepare, fidelity=table))(params)

    def walk(torque, dt, count):
        def move(_, state):
            return step(model, scene_of(case), state, torque, dt, integrator=RK4Split())[0]

        def sample(state, _):
            state = jax.lax.fori_loop(0, count, move, state)
            return state, state.crank_angle

        return jax.lax.scan(sample, BipedState().astype(dtype), length=SAMPLES)[1]

    def walks(torques, dt, count):
        one = partial(walk, dt=dt, count=count)
        return jax.lax.map(one, torques) if batch == 1 else jax.vmap(one)(torques)

    torques = np.full(IN_A_ROW, TORQUE)
    if batch > 1:  # in random order: neighbours do not switch together
        torques = np.linspace(*SPREAD, batch)
        np.random.default_rng(0).shuffle(torques[1:-1])
    return jnp.asarray(torques, dtype), jax.jit(walks)


# integrator and time constant of the constraints in timesteps. RK4 is stable down to 0.5 and, the
# more so the softer, of second order; contacts chatter below 1.
FAMILIES = {
    "stick": (("RK4", 0.5), ("RK4", 1.0), ("Euler", 2.0), ("discrete", 2.0)),
    "stick-slip": (("RK4", 1.0), ("RK4", 2.0), ("Euler", 2.0), ("discrete", 2.0)),
}
STEPS = (200, 400, 800, 1600, 3200, 6400, 12800)
"""Timesteps of a walk."""


def mujoco_walk(case: str, settings: Settings) -> Callable[[], np.ndarray]:
    """Run of a compiled model: crank angles [1, SAMPLES]."""
    mujoco: Any = import_module("mujoco")
    rollout = import_module("mujoco.rollout").rollout
    robot = mechanism(BipedParams.from_bars(dtype=np.float64))
    model = mujoco.MjModel.from_xml_string(mjcf(robot, settings, CASES[case], feet=("1",)))
    data, whole = mujoco.MjData(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
    initial = np.zeros((1, mujoco.mj_stateSize(model, whole)))
    mujoco.mj_getState(model, data, initial[0], whole)
    crank = 1 + int(model.joint(joint_of("8")).qposadr[0])  # after the time
    steps = round(DURATION / settings.timestep)
    every, torques = steps // SAMPLES, np.full((1, steps, 1), TORQUE)

    def run() -> np.ndarray:
        states, _ = rollout(model, [data], initial, torques)
        return SUPPORT_START + states[:, every - 1 :: every, crank]

    return run


def mujoco_rows(case: str, quick: bool) -> Iterator[dict[str, Any]]:
    """Every family of settings from coarse to fine, on one core."""
    for integrator, ratio in FAMILIES[case]:
        for steps in STEPS[: 3 if quick else None]:
            timestep = DURATION / steps
            settings = Settings(timestep, integrator, (ratio * timestep, 1.0))
            run = mujoco_walk(case, settings)
            words = f"{integrator}, {1e3 * timestep:.3g} ms, solref {ratio:.2g} steps"
            yield measured("MuJoCo", case, words, run, 2 if quick else 5)
