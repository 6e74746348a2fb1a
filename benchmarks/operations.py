"""What each feature of a scene adds to the compiled program and to the time of a step.

    python -m benchmarks.operations [--out FILE] [--sizes-only]

The program is a walk with fixed time steps, compiled for this machine in float32. Counted: its
instructions, those among them that compute (not parameters, constants, copies or bookkeeping), and
XLA's own count of flops and bytes. A loop's body counts once, however often it runs, so these are
sizes of programs. Timed: microseconds per step of one walk under scan, and of one of 4096 walks
under vmap; warm, compilation apart, best of several runs.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import markdown, options, provenance, write_json
from benchmarks.timing import without_kernels
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    FIDELITIES,
    INTEGRATORS,
    BipedModel,
    BipedParams,
    BipedState,
    Trajectory,
    prepare,
    simulate,
    simulate_inverse,
)

INSTRUCTION = re.compile(r"^\s+(?:ROOT )?%?[\w.\-]+ = [^=]*? ([a-z][a-z0-9\-]*)\(", re.MULTILINE)

BOOKKEEPING = {
    "parameter",
    "constant",
    "tuple",
    "get-tuple-element",
    "bitcast",
    "bitcast-convert",
    "broadcast",
    "call",
    "conditional",
    "copy",
    "fusion",
    "reshape",
    "slice",
    "while",
}
"""Instructions that compute nothing by themselves."""

DT = 0.01
"""Time step [s]."""
STEPS = {1: 200, 4096: 10}
"""How many steps the timed programs take, by batch."""
"""What a page holds around the table."""
AIM = 3.0
"""Crank rate that the walks are held near [rad/s]."""


@dataclass(frozen=True)
class Case:
    """A scene and how it is computed; motion: the crank's is given instead of the torque."""

    scene: Scene
    fidelity: str = "table"
    integrator: str = "rk4_split"
    motion: bool = False


def cases() -> dict[str, Case]:
    """One for every feature; integrators and fidelities on a floor with uniform friction."""
    ice = ([0.3, 0.6], [0.5, 0.05, 0.5])
    slippery = Scene.uniform(0.06, 0.05)
    scenes = {
        "grip": Scene.grip(),
        "grip, state only": Scene.grip(outputs="state"),
        "grip, one step": Scene.grip(steps="one"),
        "grip, payload": Scene.grip(payload=5.0),
        "uniform": slippery,
        "uniform, state only": Scene.uniform(0.06, 0.05, outputs="state"),
        "uniform, joint forces": Scene.uniform(0.06, 0.05, outputs="joints"),
        "patches": Scene.patches(*ice),
        "patches, state only": Scene.patches(*ice, outputs="state"),
        "smoothed": Scene.smoothed(0.05, 0.1),
        "smoothed, state only": Scene.smoothed(0.05, 0.1, outputs="state"),
    }
    found = {name: Case(scene) for name, scene in scenes.items()}
    found["uniform, crank motion given"] = Case(slippery, motion=True)
    for name in INTEGRATORS:
        if name != Case.integrator:
            found[f"uniform, {name}"] = Case(slippery, integrator=name)
    for name in FIDELITIES:
        if name != Case.fidelity:
            found[f"uniform, {name}"] = Case(slippery, fidelity=name)
    return found


def _torque(state: BipedState) -> jax.Array:
    return 1.0 + (AIM - jnp.asarray(state.crank_rate))


def _acceleration(state: BipedState) -> jax.Array:
    return 2.0 * (AIM - jnp.asarray(state.crank_rate))


def walk(case: Case, count: int, model: BipedModel, scene: Scene, state: BipedState) -> Trajectory:
    """`count` steps under a controller that holds the crank rate."""
    move, law = (simulate_inverse, _acceleration) if case.motion else (simulate, _torque)
    integrator = INTEGRATORS[case.integrator]
    return move(model, scene, state, law, count * DT, DT, integrator=integrator)


def start(case: Case, batch: int) -> tuple[BipedModel, Scene, BipedState]:
    """Model, scene and `batch` states spread over phases, rates and foot velocities."""
    draw = np.random.default_rng(1)
    phase = draw.uniform(np.pi / 2, 3 * np.pi / 2, batch)
    velocity = draw.uniform(-0.02, 0.02, batch) * (jax.tree.leaves(case.scene.floor) != [])
    values = phase, draw.uniform(0.8, 1.2, batch) * AIM, velocity
    phase, rate, velocity = (jnp.asarray(v, jnp.float32) for v in values)
    zero, steps = jnp.zeros(batch, jnp.float32), jnp.zeros(batch, jnp.int32)
    state = BipedState(phase, steps, rate, zero, velocity, zero)
    scene = Scene(case.scene.floor, steps=case.scene.steps, outputs=case.scene.outputs)
    scene = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), scene)
    return _prepared(case.fidelity, case.scene.payload), scene, state


@lru_cache
def _prepared(fidelity: str, payload: float | None) -> BipedModel:
    params = BipedParams.from_bars(heel=1e3, toe=1e3, dtype=jnp.float32)  # topples never
    return jax.jit(partial(prepare, fidelity=fidelity, payload=payload))(params)


def compiled_walk(case: Case, batch: int = 1) -> Any:
    """The optimised program of a walk, to be called with what `start` gives; without kernels, in
    which operations go by other names."""
    one = partial(walk, case, STEPS.get(batch, 1))

    def run(model, scene, states):
        if batch == 1:
            return one(model, scene, jax.tree.map(lambda leaf: leaf[0], states))
        return jax.vmap(one, (None, None, 0))(model, scene, states)

    with without_kernels():
        return jax.jit(run).lower(*start(case, batch)).compile()


def count(program: Any) -> dict[str, Any]:
    """Sizes of a compiled program, instructions by kind beside their sum."""
    kinds = Counter(INSTRUCTION.findall(program.as_text()))
    cost = program.cost_analysis()
    return {
        "instructions": sum(kinds.values()),
        "computing": sum(n for kind, n in kinds.items() if kind not in BOOKKEEPING),
        "flops": int(cost["flops"]),
        "bytes": int(cost["bytes accessed"]),
        "kinds": dict(kinds.most_common()),
    }


def seconds_of(program: Any, arguments: Any) -> float:
    """Seconds of one run, outputs waited for: the best of several after a first one."""
    jax.block_until_ready(program(*arguments))
    runs: list[float] = []
    while sum(runs) < 0.3 or (len(runs) < 3 and sum(runs) < 3.0):
        begin = time.perf_counter()
        jax.block_until_ready(program(*arguments))
        runs.append(time.perf_counter() - begin)
    return min(runs)


def row_of(name: str, case: Case, times: bool) -> dict[str, Any]:
    """Sizes and, with `times`, microseconds per step and per walk."""
    begin = time.perf_counter()
    program = compiled_walk(case)
    took = time.perf_counter() - begin
    numbers = sum(np.size(leaf) for leaf in jax.tree.leaves(case.scene))
    row = {"scene": name, "numbers in the scene": numbers, **count(program)}
    if times:
        row["compile [s]"] = f"{took:.1f}"
        for batch, steps in STEPS.items():
            timed = program if batch == 1 else compiled_walk(case, batch)
            each = seconds_of(timed, start(case, batch)) / steps / batch
            row[f"us per step, {batch}"] = f"{1e6 * each:.3g}"
    return row


def main(arguments: list[str] | None = None) -> None:
    """Count, time, print the table, write the JSON."""
    parser = options("operations", __doc__)
    parser.add_argument("--sizes-only", action="store_true", help="compile, but do not time")
    given = parser.parse_args(arguments)
    every, rows = cases(), []
    for place, (name, case) in enumerate(every.items(), 1):
        print(f"  {place}/{len(every)} {name}", flush=True)
        rows.append(row_of(name, case, times=not given.sizes_only))
    table = markdown([{k: v for k, v in row.items() if k != "kinds"} for row in rows])
    print(table)
    write_json({**provenance(), "rows": rows}, given.out)
    print(f"Written to {given.out}")


if __name__ == "__main__":
    main()
