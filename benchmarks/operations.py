"""How large the compiled step is, scene by scene: what is left out of a scene is not paid for.

    python -m benchmarks.operations [--out FILE]

For one step of one walk with tables for M, P and Y: instructions of the program XLA has optimised
for this machine, those among them that compute (not parameters, constants, copies or bookkeeping),
and XLA's own count of flops and bytes. A loop's body counts once, however often it runs, so these
are sizes of programs, not costs of a walk.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from benchmarks.report import markdown, provenance, write_json
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedModel, BipedParams, BipedState, prepare, step

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


def scenes() -> dict[str, Scene]:
    """One scene for every feature."""
    ice = ([0.3, 0.6], [0.5, 0.05, 0.5])
    return {
        "grip": Scene.grip(),
        "grip, state only": Scene.grip(outputs="state"),
        "grip, one step": Scene.grip(steps="one"),
        "grip, payload": Scene.grip(payload=5.0),
        "uniform": Scene.uniform(0.06, 0.05),
        "uniform, state only": Scene.uniform(0.06, 0.05, outputs="state"),
        "patches": Scene.patches(*ice),
        "patches, state only": Scene.patches(*ice, outputs="state"),
    }


def compiled_step(scene: Scene) -> Any:
    """The optimised program of `step` in this scene, a prepared table model given."""
    params = BipedParams.from_bars()
    model: BipedModel = jax.jit(lambda: prepare(params, fidelity="table", payload=scene.payload))()
    zero = jnp.zeros(())
    fields = dict.fromkeys(("phase", "crank_rate", "foot_position", "foot_velocity", "time"), zero)
    state = BipedState(**fields, steps=jnp.zeros((), jnp.int32))
    return jax.jit(step).lower(model, scene, state, zero, jnp.asarray(0.01)).compile()


@lru_cache
def _prepared(payload: float | None) -> BipedModel:
    make = jax.jit(partial(prepare, fidelity="table"))
    return make(BipedParams.from_bars(), payload=payload)


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


def rows() -> list[dict[str, Any]]:
    """One row a scene."""
    return [
        {
            "scene": name,
            "numbers in the scene": sum(leaf.size for leaf in map(jnp.asarray, jax.tree.leaves(s))),
            **count(compiled_step(s)),
        }
        for name, s in scenes().items()
    ]


def main(arguments: list[str] | None = None) -> None:
    """Count, print the table, write the JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.operations", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/operations.json"))
    given = parser.parse_args(arguments)
    counted = rows()
    print(markdown([{k: v for k, v in row.items() if k != "kinds"} for row in counted]))
    write_json({**provenance(), "rows": counted}, given.out)
    print(f"Written to {given.out}")


if __name__ == "__main__":
    main()
