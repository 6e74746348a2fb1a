"""What happens at the extremes: friction, rates, torques, time steps, sizes, a million steps.

    python -m benchmarks.extremes [--only THEME ...] [--calls N] [--out FILE]

Prints one table a theme and writes all of them as JSON; docs/extremes.md quotes it. Walks run on a
table of 64 pieces of degree 9 with the event-split integrator, in both precisions, on feet too long
to topple on unless said otherwise. --calls: of the long walks; the long episode has half as many.
--only: measure some themes anew and keep the rest of the file; every theme says where and when it
was measured.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.long_walks import LONG_WALKS, energy, long_episode, long_walks
from benchmarks.marching import March, Start, march
from benchmarks.report import markdown, options, provenance, read_json, write_json
from stickslip.dynamics import Status
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedModel,
    BipedParams,
    Table,
    prepare,
    reduced_inertia,
)

FIDELITY = Table(64, 9)
PRECISIONS = ("float32", "float64")
LONG_FOOT = 1e6
"""Heel and toe in crank lengths."""


@jax.jit
def prepared(params: BipedParams) -> BipedModel:
    """The robot ready for stepping; one compilation for any number of robots."""
    return prepare(params, fidelity=FIDELITY)


def robot(dtype: str, foot: float = LONG_FOOT, **changes: Any) -> BipedModel:
    """The default robot on long feet, with some of the arguments of from_bars changed."""
    return prepared(BipedParams.from_bars(heel=foot, toe=foot, dtype=jnp.dtype(dtype), **changes))


def painleve(direction: int) -> tuple[float, float]:
    """Least friction at which sliding that way has no unique solution (MODEL 1.4); the phase."""
    params = BipedParams.from_bars()
    angles = jnp.linspace(SUPPORT_START, SUPPORT_END, 4001)
    inertia = jax.jit(jax.vmap(partial(reduced_inertia, params)))(angles)
    M, P, Y = (np.asarray(column, float) for column in (inertia.M, inertia.P, inertia.Y))
    pushes = direction * P * Y > 0
    room = M * float(params.total_mass) - P**2
    bound = np.where(pushes, room / np.where(pushes, np.abs(P * Y), 1.0), np.inf)
    return float(bound.min()), float(angles[bound.argmin()])


def friction_cases() -> dict[str, Start]:
    """From none to more than Painleve allows."""
    walk: dict[str, Any] = {
        "phase": 2.0,
        "crank_rate": 3.0,
        "torque": 0.5,
        "dt": 2e-3,
        "count": 200,
    }
    cases = {f"mu {mu:g}": Start(mu, **walk) for mu in (0.0, 1e-12, 1e-6, 0.03, 10.0, 1e30)}
    cases["mu_s 0.08, mu_k 0"] = Start(0.08, 0.0, **{**walk, "phase": 2.4})
    cases["mu_s = mu_k 0.08"] = Start(0.08, 0.08, **{**walk, "phase": 2.4})
    for direction in (1, -1):
        bound, phase = painleve(direction)
        slide = Start(phase=phase, crank_rate=0.5, foot_velocity=0.2 * direction, dt=1e-5)
        for share in (0.999, 1.001):
            words = "forwards" if direction > 0 else "backwards"
            cases[f"slides {words}, mu {share} x {bound:.4f}"] = replace(
                slide, mu_static=share * bound
            )
    return cases


def rate_cases() -> dict[str, Start]:
    """A crank kicked at the end of the support phase, no torque, mu 1, for 1 s."""
    rates = [6, 8.6, 9, 12, 20, 30, 50, 100, 1000]
    starts = {1: SUPPORT_START, -1: SUPPORT_END}
    return {
        f"kick {sign * rate:g} rad/s": Start(
            phase=phase, crank_rate=sign * rate, dt=5e-3, count=200
        )
        for sign, phase in starts.items()
        for rate in rates
    }


def torque_cases(dtype: str) -> dict[str, Start]:
    """From rest at pi/2, mu 1, up to 2 s, on the default foot and on a long one."""
    torques = [0, 0.1, 0.5, 1, 2, 5, 10, 50, 100, 1000]
    torques += [-torque for torque in torques[1:]]
    feet = {"foot": robot(dtype, 8.0), "long foot": robot(dtype)}
    return {
        f"{torque:g} N m, {name}": Start(torque=torque, dt=5e-3, count=400, model=model)
        for name, model in feet.items()
        for torque in torques
    }


def robot_cases(dtype: str) -> dict[str, Start]:
    """Payloads, and lengths and masses by factors; each walks 0.4 s of its own time."""
    cases = {}
    for payload in (0.0, 5.0, 15.0, 100.0):
        model = robot(dtype, payload=payload)
        cases[f"payload {payload:g} kg"] = Start(
            0.06, 0.05, 2.0, 3.0, torque=0.5, dt=2e-3, count=200, model=model
        )
    for length in (1e-3, 1.0, 1e3):
        for mass in (1e-6, 1.0, 1e6):
            model = robot(
                dtype,
                crank_length=0.03 * length,
                bar_density=1.48 * mass / length,
                hip_mass=0.7 * mass,
                foot_mass=0.3 * mass,
                foot_inertia=1e-3 * mass * length**2,
            )
            second = length**0.5
            cases[f"lengths x {length:g}, masses x {mass:g}"] = Start(
                0.06, 0.05, 2.0, 3.0 / second, torque=0.5 * mass * length,
                dt=2e-3 * second, count=200, model=model,
            )  # fmt: skip
    return cases


def rows_of(cases: dict[str, Start], end: March, dtype: str) -> list[dict[str, Any]]:
    """One row a walk."""
    state, contact = end.state, end.contact
    return [
        {
            "case": name,
            "precision": dtype,
            "status": end.status[i].name,
            "time [s]": f"{state.time[i]:.5g}",
            "crank angle [rad]": f"{state.phase[i] + np.pi * state.steps[i]:.6f}",
            "crank rate [rad/s]": f"{state.crank_rate[i]:.5g}",
            "slide [m]": f"{state.foot_position[i]:.4g}",
            "normal force [N]": f"{contact.normal_force[i]:.4g}",
            "most switches": int(end.most_switches[i]),
            "sound": bool(end.sound[i]),
        }
        for i, name in enumerate(cases)
    ]


def step_size_rows() -> list[dict[str, Any]]:
    """Error of 0.1 s of a slipping walk against time steps of 10 us in double precision."""
    walk = Start(0.06, 0.05, 2.0, 3.0, torque=0.9)
    sizes = [1e-6, 1e-5, 1e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1]
    rows = [replace(walk, dt=size, count=round(0.1 / size)) for size in sizes]
    ends = {}
    for dtype in PRECISIONS:
        with jax.enable_x64(dtype == "float64"):
            ends[dtype] = march(rows, robot(dtype), jnp.dtype(dtype))
    exact = ends["float64"].of(1).state
    return [
        {
            "time step [s]": f"{size:g}",
            "precision": dtype,
            "status": end.status[i].name,
            "angle error [rad]": f"{abs(end.state.phase[i] - exact.phase):.1e}",
            "rate error [rad/s]": f"{abs(end.state.crank_rate[i] - exact.crank_rate):.1e}",
            "slide error [m]": f"{abs(end.state.foot_position[i] - exact.foot_position):.1e}",
        }
        for dtype, end in ends.items()
        for i, size in enumerate(sizes)
    ]


def anywhere(count: int = 960) -> list[Start]:
    """Random starts: rates to 1e3 rad/s, slides to 100 m/s, torques to 10 kN m, steps to 0.1 s."""
    rng = np.random.default_rng(0)

    def spread(low: float, high: float, every: int) -> np.ndarray:
        value = rng.choice([-1, 1], count) * 10 ** rng.uniform(low, high, count)
        value[rng.permutation(count)[: count // every]] = 0.0
        return value

    phase = rng.uniform(SUPPORT_START, SUPPORT_END, count)
    phase[::7], phase[3::7] = SUPPORT_START, SUPPORT_END
    mu_static = np.abs(spread(-12, 2, 9))
    columns = {
        "mu_static": mu_static,
        "mu_kinetic": mu_static * rng.choice([0.0, 0.5, 1.0], count),
        "phase": phase,
        "crank_rate": spread(-3, 3, 5),
        "foot_velocity": spread(-9, 2, 3),
        "torque": spread(-3, 4, 6),
        "dt": 10 ** rng.uniform(-6, -1, count),
    }
    return [
        replace(Start(count=20), **dict[str, Any](zip(columns, map(float, row), strict=True)))
        for row in zip(*columns.values(), strict=True)
    ]


def anywhere_rows(integrators: tuple[str, ...]) -> list[dict[str, Any]]:
    """How random starts end, and whether both precisions say the same."""
    rows = []
    for integrator in integrators:
        words: dict[str, list[str]] = {}
        for dtype in PRECISIONS:
            with jax.enable_x64(dtype == "float64"):
                end = march(anywhere(), robot(dtype), jnp.dtype(dtype), integrator)
            words[dtype] = [status.name for status in end.status]
            counted = Counter(words[dtype])
            rows.append(
                {
                    "integrator": integrator,
                    "precision": dtype,
                    **{status.name: counted[status.name] for status in Status},
                    "unsound": int(np.sum(~end.sound)),
                    "most switches": int(end.most_switches.max()),
                }
            )
        same = np.mean([a == b for a, b in zip(*words.values(), strict=True)])
        rows[-1]["same in both"] = rows[-2]["same in both"] = f"{100 * same:.1f} %"
    return rows


def long_rows(calls: int, size: float = 0.005) -> list[dict[str, Any]]:
    """Drift of single against double precision over many calls."""
    ends, seconds = {}, {}
    for dtype in PRECISIONS:
        print(f"{calls} calls in {dtype} ...", file=sys.stderr, flush=True)
        with jax.enable_x64(dtype == "float64"):
            model = robot(dtype)
            long_walks(model, 1)
            begun = time.perf_counter()
            ends[dtype] = long_walks(model, calls, size)
            seconds[dtype] = time.perf_counter() - begun
    (single, words, switches), (double, *_) = ends["float32"], ends["float64"]
    turned = [np.asarray(one.phase, float) + np.pi * one.steps for one in (single, double)]
    with jax.enable_x64(True):
        exact = robot("float64")
    energies = [energy(exact, one) for one in (single, double)]
    return [
        {
            "walk": name,
            "calls": calls,
            "status": Status(int(words[i])).name,
            "steps": int(double.steps[i]),
            "switches": int(switches[i]),
            "angle drift [rad]": f"{turned[0][i] - turned[1][i]:.2e}",
            "relative": f"{abs(turned[0][i] / turned[1][i] - 1):.1e}",
            "slide drift [m]": f"{float(single.foot_position[i]) - double.foot_position[i]:.1e}",
            "energy, single [J]": f"{energies[0][i]:.6f}",
            "energy, double [J]": f"{energies[1][i]:.6f}",
            "us per call": f"{1e6 * seconds['float32'] / calls:.0f}",
        }
        for i, name in enumerate(LONG_WALKS)
    ]


def sum_rows(calls: int) -> list[dict[str, Any]]:
    """What an episode adds up to, beside the exact sums of the same terms."""
    ends = {}
    for dtype in PRECISIONS:
        with jax.enable_x64(dtype == "float64"):
            ends[dtype] = long_episode(dtype, calls)
    return [
        {"sum": name, "at the end": f"{ends['float64'][name][1]:.1f}"}
        | {f"error, {dtype}": f"{np.subtract(*end[name]):.1e}" for dtype, end in ends.items()}
        for name in ends["float64"]
    ]


def case_rows() -> dict[str, list[dict[str, Any]]]:
    """The tables that are lists of cases."""
    tables: dict[str, list[dict[str, Any]]] = {"friction": [], "rates": [], "torques": []}
    tables["robots"] = []
    for dtype in PRECISIONS:
        with jax.enable_x64(dtype == "float64"):
            themes = {
                "friction": friction_cases(),
                "rates": rate_cases(),
                "torques": torque_cases(dtype),
                "robots": robot_cases(dtype),
            }
            for theme, cases in themes.items():
                end = march(list(cases.values()), robot(dtype), jnp.dtype(dtype))
                tables[theme] += rows_of(cases, end, dtype)
    return tables


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the tables, write the JSON."""
    parser = options("extremes", __doc__)
    parser.add_argument("--calls", type=int, default=1_000_000)
    parser.add_argument("--integrators", nargs="*", default=["rk4_split"])
    themes = {
        "cases": case_rows,
        "time-steps": lambda: {"time steps": step_size_rows()},
        "anywhere": lambda: {"anywhere": anywhere_rows(tuple(given.integrators))},
        "long-episode": lambda: {"long episode": sum_rows(given.calls // 2)},
        "long-walks": lambda: {"long walks": long_rows(given.calls)},
    }
    parser.add_argument("--only", nargs="*", choices=themes, default=list(themes))
    given = parser.parse_args(arguments)
    for name in given.only:
        print(f"{name} ...", file=sys.stderr, flush=True)
        tables = themes[name]()
        for theme, rows in tables.items():
            print(f"\n{theme}\n\n{markdown(rows)}", flush=True)
        measured = {theme: {**provenance(), "rows": rows} for theme, rows in tables.items()}
        write_json(read_json(given.out) | measured, given.out)
    print(f"\nWritten to {given.out}")


if __name__ == "__main__":
    main()
