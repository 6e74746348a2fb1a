"""What `stickslip.dynamics.ugv.recommendation` promises of settings.

    python -m benchmarks.ugv [--quick] [--update | --redraw] [--only PART ...] [--out FILE]

promise: errors and statuses of settings over random vehicles, ground and postures. costs: processor
time of a pose. Pages and data: what `recommend` reads, and the table of docs/drives.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks import report
from benchmarks.timing import built, seconds_of
from benchmarks.ugv import poses
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, equilibrium
from stickslip.dynamics.ugv.ground.roughness import class_roughness, rough_waves
from stickslip.records.files import write_whole

NAMES = ("ground", "place", "solver", "dtype")
"""What a promise is about."""
DOCUMENT = Path("docs/drives.md")
DATA = Path("dynamics/ugv/measured.json")
BATCHES = (1, 1 << 14)
START, END = 0.0, 8.0
"""Start and end of every track [m]."""
PATIENCE = 0.05
"""Length of a timed run [s]; the median of five counts."""


def waves() -> Track:
    """Rough ground of ISO class D in closed form, a sum of 64 cosines."""
    return Track(rough_waves(jax.random.key(0), class_roughness("D")), START, END)


def sines(x: jax.Array) -> jax.Array:
    """Height of ground that is given as a function, its slopes by differentiation."""
    return 0.05 * jnp.sin(2 * x + 0.3) + 0.02 * jnp.sin(5 * x + 1) + 0.006 * jnp.sin(9 * x + 2)


GROUNDS: dict[str, Callable[[], Track]] = {
    "closed": lambda: Track.bump(start=START, end=END),
    "waves": waves,
    "spline": lambda: waves().resampled(-12.0, 20.0, 512),
    "function": lambda: Track.from_function(sines, START, END),
}
"""The track whose cost stands for a kind of ground; every table costs the same."""


def costs(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each ground, solver, precision and batch."""
    grounds = list(GROUNDS)[:2] if quick else GROUNDS
    solvers = poses.SOLVERS[1:2] if quick else poses.SOLVERS
    for ground, solver, dtype, batch in product(grounds, solvers, poses.DTYPES, BATCHES):
        names = {"ground": ground, "solver": report.code_of(solver), "dtype": dtype}
        yield {**names, "batch": batch, "cost": cost(ground, solver, dtype, batch)}


def cost(ground: str, solver: PoseSolver, dtype: str, batch: int) -> float:
    """Processor time of all that a pose of the default vehicle has [s]; front contacts from 2 to
    7.5 m and leg angles over the whole range."""
    with jax.enable_x64(True):
        track = GROUNDS[ground]()
    with jax.enable_x64(dtype == "float64"):
        params, random = UGVParams(), np.random.default_rng(0)
        x = random.uniform(2.0, 7.5, batch)
        angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (batch, 2))
        drawn = jnp.asarray(x, dtype), jnp.asarray(angles, dtype)
        arguments = (track.astype(jnp.dtype(dtype)), *drawn)
        answers = partial(equilibrium, params, friction=poses.FRICTION, solver=solver)
        program, _ = built(answers, *arguments)
        processor, _ = seconds_of(partial(program, *arguments), PATIENCE, 5, 10_000)
    return processor / batch


def promises_of(content: dict[str, Any]) -> list[dict[str, Any]]:
    """A promise of each setting on each kind of ground and place, with its costs by batch.

    ground, place, solver (as code), dtype, poses, torque and contact (errors: typical, promised,
    worst), wrong. The two kinds of function are pooled, the worse of both counting.
    """
    costs: dict[tuple, dict[int, float]] = {}
    for row in content["costs"]:
        key = (row["ground"], row["solver"], row["dtype"])
        costs.setdefault(key, {})[row["batch"]] = row["cost"]
    groups: dict[tuple, list[dict[str, Any]]] = {}
    for row in content["promise"]:
        ground = "function" if row["ground"] in poses.AS_FUNCTION else row["ground"]
        groups.setdefault((ground, *(row[name] for name in NAMES[1:])), []).append(row)

    def worst(rows: list[dict[str, Any]], name: str) -> list[float]:
        return [max(each) for each in zip(*(row[name] for row in rows), strict=True)]

    return [
        dict(zip(NAMES, names, strict=True))
        | {name: worst(rows, name) for name in ("torque", "contact")}
        | {name: sum(row[name] for row in rows) for name in ("poses", "wrong")}
        | {"costs": costs.get((names[0], *names[2:]), {})}
        for names, rows in groups.items()
    ]


def recommended(content: dict[str, Any]) -> list[dict[str, Any]]:
    """Promises of the settings that may be recommended.

    In some batch no other setting is cheaper and as accurate, of those that check as much: for
    hollow ground and clearance.
    """
    able = [p for p in promises_of(content) if p["wrong"] == 0 and p["costs"]]

    def kind(p: dict[str, Any]) -> tuple:
        return p["ground"], p["place"], p["dtype"], "samples=0" not in p["solver"]

    def rated(p: dict[str, Any], batch: int) -> tuple[float, float, float]:
        return p["costs"].get(batch, np.inf), p["torque"][1], p["contact"][1]

    def beaten(p: dict[str, Any], batch: int) -> bool:
        own, others = rated(p, batch), [rated(one, batch) for one in able if kind(one) == kind(p)]
        return any(one != own and np.all(np.less_equal(one, own)) for one in others)

    return [p for p in able if not all(beaten(p, batch) for batch in p["costs"])]


def source(content: dict[str, Any]) -> str:
    """Text of dynamics/ugv/measured.json; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    promises, costs = [], {}
    for p in recommended(content):
        index = settings.setdefault((p["solver"], p["dtype"]), len(settings))
        errors = [  # rounded up but for the median
            [report.three(typical), *(report.three(1.005 * one) for one in others)]
            for typical, *others in (p["torque"], p["contact"])
        ]
        promises.append([p["ground"], p["place"], index, p["poses"], *errors])
        costs |= {(p["ground"], index, batch): cost for batch, cost in p["costs"].items()}
    return report.rows_json(
        {
            "measured_on": report.where(content, "promise"),
            "quantile": poses.QUANTILE,
            "confidence": poses.CONFIDENCE,
            "settings": [[report.called(solver)[1], dtype] for solver, dtype in settings],
            "promises": promises,
            "costs": [[*key, report.three(cost)] for key, cost in sorted(costs.items())],
        }
    )


def table(content: dict[str, Any]) -> str:
    """Promises of each recommended setting, with its cost in the largest batch."""
    lines: dict[tuple, dict[str, Any]] = {}
    columns = [f"{name}, {place}" for name in ("torque", "contact") for place in poses.PLACES]
    for p in recommended(content):
        names = {"ground": p["ground"], "solver": p["solver"], "type": p["dtype"]}
        line = lines.setdefault(tuple(names.values()), names | dict.fromkeys(columns, "-"))
        for name in ("torque", "contact"):
            line[f"{name}, {p['place']}"] = f"{p[name][1]:.1e}"
        line["cost [s]"] = f"{p['costs'][max(p['costs'])]:.1e}"
    errors, costs = (report.where(content, part) for part in ("promise", "costs"))
    return (
        f"Measured on {errors}; costs: {costs}. Torque in weight times wheel radius, contact in "
        "wheel radii; processor seconds for each of 16384 poses.\n\n"
        f"{report.markdown(list(lines.values()))}"
    )


PARTS: dict[str, Any] = {"promise": poses.promises, "costs": costs}


def update(content: dict[str, Any]) -> None:
    """Write the data of `recommend` and the page's table."""
    write_whole(DATA, source(content))
    report.put_between(DOCUMENT, table(content))


if __name__ == "__main__":
    report.measured_by_command("ugv", __doc__, PARTS, update)
