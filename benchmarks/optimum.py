"""The best that can be earned on three tasks of the biped's, and what is known of it.

    python -m benchmarks.optimum [--rates R ...] [--fineness F] [--depth D] [--docs FILE]
        [--out FILE]

For each commanded rate, on a floor of 0.06 static and 0.05 kinetic friction: value iteration on a
grid and on one with half its cells, then 48 episodes of the value function's policy and of the
baselines from the same starts (any phase, crank rates from 0 to the commanded one). Writes JSON,
the table of docs/optimum.md, and a picture of the value functions beside it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.report import markdown, options, provenance, put_between, where, write_json
from stickslip.agents import ComputedTorque, CrankSpeedPI, evaluate
from stickslip.agents.biped.task import from_anywhere
from stickslip.agents.optimum import Known, Solution, known, replay, solve
from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv
from stickslip.optim.dynamic_programming import Ahead

if TYPE_CHECKING:
    from stickslip.envs.biped.params import BipedEnvParams

MU = (0.06, 0.05)
EPISODES = 48
BEAM = 4
MARKS = ("<!-- optimum -->", "<!-- end of optimum -->")
BASELINES = {"crank-speed PI": CrankSpeedPI(), "computed torque": ComputedTorque()}


def task(env: BipedEnv, rate: float) -> BipedEnvParams:
    """The standard task at another commanded rate [rad/s], begun anywhere."""
    return from_anywhere(env.make_params(commanded_rate=rate, scene=Scene.uniform(*MU)))


def measure(rate: float, fineness: float, depth: int) -> tuple[dict[str, Any], Solution, Known]:
    """A task's row, its solution and what is known."""
    env = BipedEnv()
    params, ahead = task(env, rate), Ahead(depth, BEAM)
    coarser = solve(env, params, fineness=fineness / 2)
    fine = solve(env, params, fineness=fineness, ahead=ahead, progress=True)
    found = known(fine, coarser=coarser, episodes=EPISODES)
    rows = evaluate(env, BASELINES, {"": params}, episodes=EPISODES)
    greedy = replay(fine.policy.with_ahead(1, BEAM), params, range(EPISODES))
    row: dict[str, Any] = {"rate": rate, "known": found.in_words(), "holds": found.holds}
    row |= {"earned": found.earned._asdict(), "falls": found.falls._asdict()}
    row |= {"ceiling": found.ceiling, "estimate": found.estimate, "coarser": found.coarser}
    row |= {"off_grid": found.off_grid, "grid": fine.policy.grid.in_words()}
    row |= {"seconds": fine.seconds, "actions": len(fine.policy.actions), "depth": depth}
    row["one step ahead"] = {"return": greedy.earned._asdict(), "falls": greedy.falls._asdict()}
    for name in BASELINES:
        metrics = rows.row("", name).metrics
        row[name] = {one: metrics[one]._asdict() for one in ("return", "falls")}
    print(f"{rate:g} rad/s: {found.in_words()}", flush=True)
    return row, fine, found


def table(rows: list[dict[str, Any]]) -> str:
    """Returns and falls of everybody, and what the grids say."""

    def cell(one: dict[str, Any]) -> str:
        fell = one["falls"]["value"]
        value, high = one["return"]["value"], one["return"]["high"]
        return f"{value:.2f} ± {high - value:.2f}" + (f", {fell:.0%} fall" if fell else "")

    shown = []
    for row in rows:
        own = {"return": row["earned"], "falls": row["falls"]}
        shown.append(
            {"commanded rate [rad/s]": f"{row['rate']:g}"}
            | {name: cell(row[name]) for name in BASELINES}
            | {"one step ahead": cell(row["one step ahead"])}
            | {f"{row['depth']} steps ahead: lower bound": cell(own)}
            | {
                "grid's estimate": f"{row['estimate']:.2f}",
                "half the cells": f"{row['coarser']:.2f}",
            }
            | {"off the grid": f"{row['off_grid']:.1%}", "upper bound": f"{row['ceiling']:.0f}"}
        )
    return markdown(shown)


def draw(solved: list[tuple[Solution, Known]], path: Path) -> None:
    """Value and torque of a foot at rest over phase and crank rate, with what was walked."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2 * len(solved), 7.2), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, len(solved), squeeze=False)
    for column, (solution, found) in enumerate(solved):
        params, rest = solution.params, solution.policy.grid.sheets[0]
        phase, rate = (np.asarray(axis.nodes) for axis in rest.axes)
        value = np.asarray(solution.values.value)[: rest.size].reshape(rest.shape)
        torque = np.asarray(solution.policy.actions)[np.asarray(solution.chosen)[: rest.size], 0]
        torque = float(params.torque_limit) * torque.reshape(rest.shape)
        on = np.asarray(found.replay.sheet) == 0
        walked = np.asarray(found.replay.coordinates)[on]
        pictures = (value, "viridis", "expected return"), (torque, "coolwarm", "torque [N m]")
        for row, (numbers, colours, name) in enumerate(pictures):
            ax = axes[row, column]
            mesh = ax.pcolormesh(
                phase / np.pi, rate, numbers.T, cmap=colours, shading="gouraud", rasterized=True
            )
            ax.plot(walked[:, 0] / np.pi, walked[:, 1], ".", ms=0.6, color="black", alpha=0.35)
            ax.set_xlabel("phase [pi rad]")
            ax.set_ylabel("crank rate [rad/s]")
            ax.set_title(f"{name}, commanded {float(params.commanded_rate):g} rad/s", fontsize=9)
            figure.colorbar(mesh, ax=ax)
    figure.savefig(path)


def main(arguments: list[str]) -> None:
    """Measure, print, write."""
    parser = options("optimum", __doc__)
    parser.add_argument("--rates", type=float, nargs="+", default=[3.0, 4.5, 6.0])
    parser.add_argument("--fineness", type=float, default=1.0)
    parser.add_argument("--depth", type=int, default=4)
    parser.add_argument(
        "--docs", type=Path, help="page to put the table into, and a picture beside"
    )
    asked = parser.parse_args(arguments)
    rows, solved = [], []
    for rate in asked.rates:
        row, solution, found = measure(rate, asked.fineness, asked.depth)
        rows.append(row)
        solved.append((solution, found))
        write_json({**provenance(), "mu": MU, "episodes": EPISODES, "rows": rows}, asked.out)
    content = {**provenance(), "mu": MU, "episodes": EPISODES, "rows": rows}
    print(table(rows))
    page = asked.out if asked.docs is None else asked.docs
    draw(solved, page.with_suffix(".png"))
    if asked.docs is not None:
        put_between(asked.docs, f"{table(rows)}\n\n{where(content)}", MARKS)


if __name__ == "__main__":
    main(sys.argv[1:])
