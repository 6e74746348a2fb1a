"""Which solver of the Newton-Euler systems to trust in single precision, and what each one costs.

    python -m benchmarks.joints [--out FILE] [--only PART ...]

Accuracy: float32 against float64 with the same inputs, over the whole turn, random rates and
torques; errors as parts of the largest joint force, of the weight, of weight times crank length, of
1 rad/s^2 plus the acceleration. "alone" is what the solver adds by itself: the same float32
equations solved in float64. Then lengths and masses far off, linkages a hair from not closing,
condition numbers over the turn, and time per solve.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import kept_parts, markdown, options, write_json
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.bodies.body_equations import body_equations
from stickslip.dynamics.biped.bodies.joint_solvers import SOLVERS, unit_solutions
from stickslip.dynamics.biped.bodies.newton_euler import (
    GIVEN,
    SYSTEMS,
    NewtonEuler,
    condition_number,
    newton_euler,
)
from stickslip.dynamics.biped.links import least_closure
from stickslip.dynamics.biped.mechanism.link_motion import link_motion

WITH_MEDIANS = ("conditions", "scales", "accuracy")
STATES = 1024
ANGLES = 90
SCALES = ((1.0, 1.0), (1e-3, 1.0), (1e3, 1.0), (1.0, 1e-6), (1.0, 1e6))
"""Lengths and masses times these."""

MARGINS = (1e-2, 1e-4, 1e-6)
"""Least closing margins of the linkages a hair from not closing."""


def states(length: float, mass: float, seed: int = 0) -> dict[str, np.ndarray]:
    """Random instants, the same motion at every scale: rates by 1/sqrt(length), torques by both."""
    rng = np.random.default_rng(seed)
    pace, work = length**-0.5, mass * length
    return {
        "theta": rng.uniform(0, 2 * np.pi, STATES),
        "crank_rate": rng.uniform(-5, 5, STATES) * pace,
        "torque": rng.uniform(-2, 2, STATES) * work,
        "crank_acceleration": rng.uniform(-50, 50, STATES) / length,
        "foot_acceleration": rng.uniform(-5, 5, STATES),
        "mu_kinetic": rng.uniform(0, 0.5, STATES),
        "direction": rng.choice([-1.0, 1.0], STATES),
    }


def scaled(params: BipedParams, length: float, mass: float) -> BipedParams:
    """The same robot, all lengths and masses times a factor."""
    kept = {"mass", "inertia", "centre", "payload", "gravity"}
    changed = {n: v * length for n, v in vars(params).items() if n not in kept}
    changed |= {"mass": params.mass * mass, "centre": params.centre * length}
    return BipedParams(**(vars(params) | changed | {"inertia": params.inertia * mass * length**2}))


@partial(jax.jit, static_argnums=(2, 3))
def solve(
    params: BipedParams, instants: dict[str, jax.Array], system: str, solvers: tuple[str, ...]
):
    """One system by several solvers, one instant after the other: solver to NewtonEuler."""

    def one(values):
        return {solver: _solve(params, values, system, solver) for solver in solvers}

    return jax.lax.map(one, instants)


def _solve(params: BipedParams, values: dict[str, jax.Array], system: str, solver: str):
    known: dict[str, Any] = {name: values[name] for name in GIVEN[system]}
    theta, rate = values["theta"], values["crank_rate"]
    return newton_euler(params, theta, rate, system=system, solver=solver, **known)


@jax.jit
def alone(params: BipedParams, angles: jax.Array) -> dict[str, jax.Array]:
    """Worst error of the unit solutions' joint forces, by column's largest: solver to angles."""

    def one(theta):
        motion = link_motion(params, theta)
        given = params, body_equations(params, motion), motion
        robot, equations, places = jax.tree.map(lambda leaf: leaf.astype(jnp.float64), given)
        want = unit_solutions(robot, equations, places, "groups").joint_forces

        def off(solver):
            got = unit_solutions(*given, solver).joint_forces
            return jnp.max(jnp.abs(got - want) / jnp.max(jnp.abs(want), axis=0))

        return {solver: off(solver) for solver in SOLVERS}

    return jax.lax.map(one, angles)


def errors(got: NewtonEuler, want: NewtonEuler, params: BipedParams) -> dict[str, np.ndarray]:
    """Errors per instant, by the natural size of each quantity."""
    weight = float(params.total_mass * params.gravity)
    sizes: dict[str, Any] = {
        "joint_forces": np.max(np.abs(want.joint_forces), axis=-1, keepdims=True),
        "torque": weight * float(params.crank),
        "normal_force": weight,
        "friction_force": weight,
        "crank_acceleration": 1 / params.crank * 0.03 + np.abs(want.crank_acceleration),
        "foot_acceleration": 1 + np.abs(want.foot_acceleration),
    }
    result = {}
    for name, size in sizes.items():
        off = np.abs(np.asarray(getattr(got, name), float) - getattr(want, name)) / size
        result[name] = off.reshape(len(off), -1).max(axis=1)
    return result


def in_both(dtype, length: float = 1.0, mass: float = 1.0):
    """Robot and instants rounded to float32 and then given in `dtype`."""
    robot = scaled(BipedParams.from_bars(dtype=jnp.float64), length, mass)
    narrow = jax.tree.map(
        lambda leaf: jnp.asarray(leaf, jnp.float32), (robot, states(length, mass))
    )
    return jax.tree.map(lambda leaf: leaf.astype(dtype), narrow)


def compared(system: str, length: float = 1.0, mass: float = 1.0):
    """Errors of every solver in float32, one system at one scale: solver to name to instants."""
    robot, given = in_both(jnp.float64, length, mass)
    want = jax.tree.map(np.asarray, solve(robot, given, system, ("groups",))["groups"])
    got = solve(*in_both(jnp.float32, length, mass), system, SOLVERS)
    return {solver: errors(got[solver], want, robot) for solver in SOLVERS}


def accuracy() -> Iterator[dict[str, Any]]:
    """Every solver and system in float32 at the default scale."""
    for system in SYSTEMS[1:]:
        for solver, off in compared(system).items():
            yield {"system": system, "solver": solver} | _worst_and_median(off)


def scales() -> Iterator[dict[str, Any]]:
    """What a solver adds to the error of its equations, and the whole error, at every scale."""
    angles = jnp.linspace(0, 2 * np.pi, ANGLES, dtype=jnp.float32)
    for length, mass in SCALES:
        added = alone(in_both(jnp.float32, length, mass)[0], angles)
        for solver, off in compared("forward_slip", length, mass).items():
            yield {
                "lengths": f"{length:g}",
                "masses": f"{mass:g}",
                "solver": solver,
                "alone": _show(np.asarray(added[solver])),
                "joint_forces": _show(off["joint_forces"]),
                "crank_acceleration": _show(off["crank_acceleration"]),
            }


def near_dead() -> Iterator[dict[str, Any]]:
    """Rockers nearly too short to close: the worst angle of each, in float64 and float32."""
    robot = BipedParams.from_bars(dtype=jnp.float64)
    least = jax.jit(lambda rocker: least_closure(_with_rocker(robot, rocker), 128))

    @jax.jit
    def condition(params, angle):
        return {s: condition_number(params, angle, solver=s) for s in ("lu", "scaled", "block")}

    for margin in MARGINS:
        tight, angle = _tight(robot, least, margin)
        row: dict[str, Any] = {"closing margin": f"{margin:g}"}
        for solver, found in condition(tight, angle).items():
            row[f"condition, {solver}"] = f"{float(found):.1e}"
        for solver, off in alone(tight.astype(jnp.float32), jnp.float32(angle)[None]).items():
            row[f"alone, {solver}"] = f"{float(off[0]):.1e}"
        yield row


def _tight(robot: BipedParams, least, margin: float) -> tuple[BipedParams, jax.Array]:
    """The robot with its rocker so short that the loop's least margin is `margin`."""
    low, high = 0.3 * robot.rocker, robot.rocker
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if float(least(middle)[0]) > margin else (middle, high)
    return _with_rocker(robot, high), least(high)[1]


def _with_rocker(robot: BipedParams, rocker) -> BipedParams:
    return BipedParams(**(vars(robot) | {"rocker": rocker}))


def conditions() -> Iterator[dict[str, Any]]:
    """Condition numbers over the turn, by system, and for lengths far off: worst (median)."""
    angles = jnp.linspace(0, 2 * np.pi, ANGLES, endpoint=False)
    cases = [(solver, system) for solver in ("lu", "scaled") for system in SYSTEMS]
    cases.append(("block", "inverse"))  # the same for all

    @jax.jit
    def along(params):
        def one(theta):
            return [
                condition_number(params, theta, solver=solver, system=system, mu_kinetic=0.5)
                for solver, system in cases
            ]

        return jax.lax.map(one, angles)

    lengths = (1.0, 1e-3, 1e3)
    robot = BipedParams.from_bars(dtype=jnp.float64)
    found = [along(scaled(robot, length, 1.0)) for length in lengths]
    for i, (solver, system) in enumerate(cases):
        row: dict[str, Any] = {"solver": solver, "system": "any" if solver == "block" else system}
        for length, values in zip(lengths, found, strict=True):
            row[f"lengths x {length:g}"] = _show(np.asarray(values[i]))
        yield row


def times(repeats: int = 30) -> Iterator[dict[str, Any]]:
    """Best time of one forward solve, kinematics included; "motion": that part alone."""
    for dtype in (jnp.float32, jnp.float64):
        robot, given = in_both(dtype)
        for solver in ("motion", *SOLVERS):
            row: dict[str, Any] = {"dtype": jnp.dtype(dtype).name, "solver": solver}
            for batch in (1, 1024):
                some = {name: value[:batch] for name, value in given.items()}
                spent = []
                for _ in range(repeats + 1):
                    start = time.perf_counter()
                    jax.block_until_ready(_timed(robot, some, solver))
                    spent.append(time.perf_counter() - start)
                row[f"us per solve, batch {batch}"] = f"{min(spent[1:]) / batch * 1e6:.2f}"
            yield row


@partial(jax.jit, static_argnums=2)
def _timed(params, instants, solver: str):
    if solver == "motion":
        return jax.vmap(lambda theta: _bodies(params, theta))(instants["theta"])
    return jax.vmap(lambda values: _solve(params, values, "forward_stick", solver))(instants)


def _bodies(params, theta) -> tuple[jax.Array, ...]:
    """The motion of the bodies alone, without pins."""
    motion = link_motion(params, theta)
    centres = motion.centres, motion.centre_slopes, motion.centre_curvatures
    return *centres, motion.angles, motion.angle_slopes, motion.angle_curvatures


def _worst_and_median(errors: dict[str, np.ndarray]) -> dict[str, str]:
    return {name: _show(off) for name, off in errors.items()}


def _show(off: np.ndarray) -> str:
    return f"{np.max(off):.1e} ({np.median(off):.1e})"


PARTS = {
    "conditions": conditions,
    "near_dead": near_dead,
    "scales": scales,
    "accuracy": accuracy,
    "times": times,
}


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the tables, write the JSON file."""
    jax.config.update("jax_enable_x64", True)
    parser = options("joints", __doc__)
    parser.add_argument(
        "--only",
        nargs="+",
        choices=list(PARTS),
        default=list(PARTS),
        help="measure these parts; the file keeps its others, each with its commit",
    )
    given = parser.parse_args(arguments)
    found = kept_parts(given.out, PARTS)
    for name in given.only:
        print(f"\n{name}: worst (median)" if name in WITH_MEDIANS else f"\n{name}")
        rows = []
        for row in PARTS[name]():
            rows.append(row)
            print(f"{name}: {len(rows)} rows", end="\r", flush=True)
        print(markdown(rows), flush=True)
        found[name] = rows
        found["parts"][name] = {key: found[key] for key in ("commit", "measured")}
        write_json(found, given.out)
    print(f"\nwritten to {given.out}")


if __name__ == "__main__":
    main()
