"""Size of the compiled program by feature of a scene.

    python -m benchmarks.operations [--out FILE]

The program is a walk with fixed time steps, compiled for this machine in float32. Counted: its
instructions, those among them that compute (not parameters, constants, copies or bookkeeping), and
XLA's own count of flops and bytes. A loop's body counts once, however often it runs.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import markdown, measured_parts, options
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

DT, STEPS = 0.01, 200
"""Time step [s] and number of steps."""
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


def start(case: Case) -> tuple[BipedModel, Scene, BipedState]:
    """Model, scene and initial state."""
    zero = jnp.zeros((), jnp.float32)
    phase, rate = jnp.float32(2.5), jnp.float32(AIM)
    state = BipedState(phase, jnp.zeros((), jnp.int32), rate, zero, zero, zero)
    scene = Scene(case.scene.floor, steps=case.scene.steps, outputs=case.scene.outputs)
    scene = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), scene)
    return _prepared(case.fidelity, case.scene.payload), scene, state


@lru_cache
def _prepared(fidelity: str, payload: float | None) -> BipedModel:
    params = BipedParams.from_bars(heel=1e3, toe=1e3, dtype=jnp.float32)  # topples never
    return jax.jit(partial(prepare, fidelity=fidelity, payload=payload))(params)


def compiled_walk(case: Case) -> Any:
    """The optimised program of a walk; without kernels, in which operations go by other names."""
    with without_kernels():
        return jax.jit(partial(walk, case, STEPS)).lower(*start(case)).compile()


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


def rows(quick: bool = False) -> Iterator[dict[str, Any]]:
    """A row for each case."""
    del quick
    for name, case in cases().items():
        numbers = sum(np.size(leaf) for leaf in jax.tree.leaves(case.scene))
        yield {"scene": name, "numbers in the scene": numbers, **count(compiled_walk(case))}


def main(arguments: list[str] | None = None) -> None:
    """Count, print the table, write the JSON."""
    given = options("operations", __doc__).parse_args(arguments)
    content = measured_parts({"rows": rows}, ["rows"], False, given.out)
    print(markdown([{k: v for k, v in row.items() if k != "kinds"} for row in content["rows"]]))


if __name__ == "__main__":
    main()
