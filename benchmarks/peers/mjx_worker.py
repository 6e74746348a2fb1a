"""One MJX measurement in a process of its own: `python -m benchmarks.peers.mjx_worker JSON`.

MJX's compiled step can hang the CPU backend at large batches, so the parent (mjx_batches.py) pins
this process to a core and ends it after a while. Prints one line of JSON.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers.cases import SAMPLES, SPREAD, TORQUE, Case, load, timed
from benchmarks.peers.mechanism import Mechanism
from benchmarks.peers.mjcf import CRANK_JOINT, Settings, mjcf


def measure(asked: dict[str, Any]) -> dict[str, Any]:
    """Crank angles of the first and last member, rates, seconds to compile.

    asked: case, settings (fields of the two classes), machine (fields of Mechanism as lists),
    batch, steps, wide (64 bits), repeats, budget [s].
    """
    mujoco, mjx = load("mujoco"), load("mujoco.mjx")
    jax.config.update("jax_enable_x64", asked["wide"])
    case, settings = Case(**asked["case"]), Settings(**asked["settings"])
    machine = _machine(asked["machine"])
    model = mujoco.MjModel.from_xml_string(mjcf(machine, settings, case.friction))
    crank = int(model.joint(CRANK_JOINT).qposadr[0])
    device = mjx.put_model(model)
    data = mjx.make_data(model)
    batch, every = asked["batch"], asked["steps"] // SAMPLES

    def walk(torque):
        def move(now, _):
            return mjx.step(device, now.replace(ctrl=torque[None])), None

        def sample(now, _):
            now, _ = jax.lax.scan(move, now, length=every)
            return now, now.qpos[crank]

        return jax.lax.scan(sample, data, length=SAMPLES)[1]

    torques = np.linspace(*SPREAD, batch) if batch > 1 else np.array([TORQUE])
    given = jnp.asarray(torques, data.qpos.dtype)
    begun = time.perf_counter()
    program = jax.jit(jax.vmap(walk)).lower(given).compile()
    build = time.perf_counter() - begun
    angles = np.asarray(program(given), float) + machine.crank_angle
    taken = timed(lambda: jax.block_until_ready(program(given)), asked["repeats"], asked["budget"])
    return {**vars(taken), "angles": angles[[0, -1]].tolist(), "build": build}


def _machine(fields: dict[str, Any]) -> Mechanism:
    arrays = {name: np.asarray(fields[name]) for name in ("mass", "inertia", "centre", "slot")}
    pins = {name: np.asarray(place) for name, place in fields["pins"].items()}
    return Mechanism(**{**fields, **arrays, "pins": pins})


if __name__ == "__main__":
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print(json.dumps(measure(json.loads(sys.argv[1]))))
