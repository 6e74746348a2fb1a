"""The best gaits: speed against friction, cost of transport against speed, accuracy, baselines.

`python -m benchmarks.gaits [--only PART ...]` writes benchmarks/results/gaits.json, the pictures
docs/gaits.png and docs/gait_links.png, and the tables of docs/gaits.md.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.report import kept_parts, markdown, options, put_between, write_json
from stickslip.agents import ComputedTorque, OptimalGait, evaluate
from stickslip.agents.biped.controllers import CrankSpeedPI
from stickslip.agents.biped.task import from_anywhere
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.scene import Scene
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.rendering import theme
from stickslip.optim import GaitProblem, replay, solve
from stickslip.optim.gait.convex.limits import ground_of, torque_of
from stickslip.optimise.gait_picture import draw_robots
from stickslip.paper import drawing
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from stickslip.optim.gait.profile import Profile

TORQUE = 4.0
MUS = (0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5, 0.7, 1.0)
SPEEDS = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)
FLOORS = (0.06, 0.2, None)
AGAIN = ("time", "torque", "torque_over_phase", "work", "energy", "friction")
REPEATS = 7
GRIDS = (50, 100, 200, 400, 800)
TASKS = (
    ("mu 0.06/0.05, 3 rad/s", 0.06, 0.05, 3.0),
    ("mu 0.06/0.05, 4.5 rad/s", 0.06, 0.05, 4.5),
    ("mu 0.06/0.05, 6 rad/s", 0.06, 0.05, 6.0),
    ("mu 0.02/0.017, 5 rad/s", 0.02, 0.017, 5.0),
    ("mu 0.15/0.125, 5 rad/s", 0.15, 0.125, 5.0),
)
DOCS = Path("docs")
PARTS = ("fastest", "thrift", "accuracy", "again", "replays", "baselines")
"""Of the page; its pictures are drawn where all are measured."""


def fastest(robot: BipedParams) -> list[dict[str, Any]]:
    """Fastest mean crank rate without slip by friction, and the fastest constant one [rad/s]."""
    rows = []
    for mu in MUS:
        problem = GaitProblem.periodic(robot, "time", mu=mu, torque_limit=TORQUE)
        found = solve(problem)
        rows.append(
            {
                "mu": mu,
                "fastest": np.pi / found.held_value,
                "none above": np.pi / (found.every_bound or np.nan),
                "constant rate": constant(problem.instance.profiles[0], mu),
                "status": found.status.name,
            }
        )
    return rows


def constant(p: Profile, mu: float | None) -> float:
    """The fastest constant crank rate within friction and torque [rad/s], by halving."""
    low, high = 0.0, 40.0
    for _ in range(60):
        rate = (low + high) / 2
        b, a = np.full_like(p.M, rate**2), np.zeros_like(p.M)
        friction, normal = ground_of(p, a, b)
        fits = np.all(np.abs(torque_of(p, a, b)) <= TORQUE) and np.all(normal >= 0)
        fits = fits and (mu is None or bool(np.all(np.abs(friction) <= mu * normal)))
        low, high = (rate, high) if fits else (low, rate)
    return low


def thrift(robot: BipedParams) -> list[dict[str, Any]]:
    """Least energy (copper loss 0.5 W/(N m)^2) as cost of transport at each speed and floor."""
    rows = []
    profile = GaitProblem.periodic(robot).instance.profiles[0]
    for speed in SPEEDS:
        row: dict[str, Any] = {"mean crank rate [rad/s]": speed}
        for mu in FLOORS:
            problem = GaitProblem.periodic(
                robot, "energy", mu=mu, torque_limit=TORQUE, mean_rate=speed
            )
            found = solve(problem)
            name = "foot held" if mu is None else f"mu {mu:g}"
            there = found.gait is not None
            row[name] = found.best.cost_of_transport(0.5) if there else np.nan
            row[f"{name}, rate"] = found.mean_rate if there else np.nan
        row["constant rate"] = constant_cost(profile, speed)
        rows.append(row)
    return rows


def constant_cost(p: Profile, rate: float) -> float:
    """Cost of transport at a constant crank rate, were the floor and the motor to bear it [-]."""
    torque = torque_of(p, np.zeros_like(p.M), np.full_like(p.M, rate**2))[0]
    energy = np.trapezoid(np.maximum(torque, 0) + 0.5 * torque**2 / rate, p.theta[0])
    return float(energy / (p.robot.weight * p.robot.step_length))


def accuracy(robot: BipedParams) -> list[dict[str, Any]]:
    """What the grid leaves open, and how long a solve takes, of the fastest gait at mu 0.06."""
    rows = []
    for cells in GRIDS:
        problem = GaitProblem.periodic(robot, mu=0.06, torque_limit=TORQUE, steps=cells)
        solve(problem)
        other = GaitProblem.periodic(robot, mu=0.065, torque_limit=TORQUE, steps=cells)
        again, found = solve(other), solve(problem)
        rows.append(
            {
                "cells": cells,
                "of the grid [s]": f"{found.value:.7f}",
                "kept between nodes [s]": f"{found.held_value:.7f}",
                "no gait below [s]": f"{found.every_bound:.7f}",
                "open": f"{found.discretisation:.1e}",
                "gap of the grid": f"{found.gap:.0e}",
                "solved again [ms]": round(1000 * again.seconds),
            }
        )
    return rows


def again(robot: BipedParams) -> list[dict[str, Any]]:
    """Processor time [ms] of solving a program again with other numbers, the proofs included: the
    median of several, 200 cells. With proofs of the grid alone, and with those of every gait."""
    rows = []
    for objective in AGAIN:
        friction = objective == "friction"
        row: dict[str, Any] = {"objective": objective}
        for certify in ("grid", "every"):
            spent, solves = [], 0
            for i in range(REPEATS + 1):  # the first one builds the program
                mu = None if friction else 0.06 + 0.001 * i
                rate = None if objective == "time" else 5.0 + 0.05 * i
                problem = GaitProblem.periodic(
                    robot, objective, mu=mu, torque_limit=TORQUE, mean_rate=rate
                )
                began = time.process_time()
                solves = solve(problem, certify=certify).evaluations
                spent.append(1000 * (time.process_time() - began))
            row |= {f"{certify}: solves": solves, f"{certify} [ms]": round(np.median(spent[1:]))}
        rows.append(row)
    return rows


def replays(robot: BipedParams) -> list[dict[str, Any]]:
    """Gaits that leave 2 % of the friction unused, walked on the floor."""
    problems = {
        "least energy, 4.5 rad/s": GaitProblem.periodic(
            robot, "energy", mu=0.0588, torque_limit=TORQUE, mean_rate=4.5
        ),
        "fastest": GaitProblem.periodic(robot, "time", mu=0.0588, torque_limit=TORQUE),
        "3 steps from rest": GaitProblem.transfer(robot, 3, mu=0.0588, torque_limit=TORQUE),
        "3 steps, rest to rest": GaitProblem.transfer(
            robot, 3, mu=0.0588, torque_limit=TORQUE, end_rate=0.0
        ),
    }
    rows = []
    for name, problem in problems.items():
        gait = solve(problem).best
        for gain in (0.0, 2.0):
            one = replay(robot, gait, mu=0.06, feedback=gain)
            rows.append(
                {
                    "gait": name,
                    "feedback [1/rad]": gain,
                    "slid [m]": f"{one.slid:.1e}",
                    "mean rate [rad/s]": f"{one.mean_rate:.5f}",
                    "promised": f"{one.promised_mean_rate:.5f}",
                    "work [J]": f"{one.work:.5f}",
                    "promised ": f"{one.promised_work:.5f}",
                }
            )
    return rows


def baselines(episodes: int) -> list[dict[str, Any]]:
    """Returns of 10 s episodes from any phase and up to the commanded rate."""
    env = BipedEnv()
    tasks = {
        name: from_anywhere(env.make_params(scene=Scene.uniform(mu, mu_k), commanded_rate=rate))
        for name, mu, mu_k, rate in TASKS
    }
    players = {"PI": CrankSpeedPI(), "computed torque": ComputedTorque(), "gait": OptimalGait()}
    table = evaluate(env, players, tasks, episodes=episodes)
    rows: dict[str, dict[str, Any]] = {}
    for one in table.rows:
        row = rows.setdefault(one.scene, {"task": one.scene})
        falls = 100 * one.metrics["falls"].value
        row[one.controller] = f"{one.metrics['return'].value:.2f} ({falls:.0f} %)"
    return list(rows.values())


def draw(content: dict[str, Any]) -> bytes:
    """Both curves."""
    figure, axes = drawing.sheet(1, 2, height=3.6)
    left, right = axes[0]
    rows = content["fastest"]["rows"]
    mu = [row["mu"] for row in rows]
    left.semilogx(mu, [r["fastest"] for r in rows], "o-", color=theme.MOTOR, label="best gait")
    rates = [row["constant rate"] for row in rows]
    left.semilogx(mu, rates, "s--", color=theme.SLIDES, label="constant crank rate")
    left.set_ylim(bottom=0)
    left.legend(frameon=False, fontsize=8.5)
    note = f"motor {TORQUE:g} N m"
    drawing.name_panel(left, "fastest without slip [rad/s]", note, "static friction [-]")
    rows = content["thrift"]["rows"]
    for (name, look), colour in zip(
        (("mu 0.06", "o-"), ("mu 0.2", "^-"), ("foot held", "v-")),
        drawing.shades(3),
        strict=True,
    ):
        speeds = [row[f"{name}, rate"] for row in rows]
        right.plot(speeds, [row[name] for row in rows], look, color=colour, label=name)
    rate = [row["mean crank rate [rad/s]"] for row in rows]
    costs = [row["constant rate"] for row in rows]
    right.plot(rate, costs, "s--", color=theme.SLIDES, label="constant rate")
    right.set_ylim(0, 0.5)
    right.legend(frameon=False, fontsize=8.5)
    drawing.name_panel(
        right, "least cost of transport [-]", "copper included", "mean crank rate [rad/s]"
    )
    return drawing.png(figure, "The best gaits of all that do not slip")


def draw_links(robot: BipedParams) -> bytes:
    """Three gaits link by link."""
    kinds = (
        ("fastest, mu 0.06", GaitProblem.periodic(robot, mu=0.06, torque_limit=TORQUE)),
        (
            "least energy at 3 rad/s, mu 0.06",
            GaitProblem.periodic(robot, "energy", mu=0.06, torque_limit=TORQUE, mean_rate=3.0),
        ),
        (
            "quickest 3 steps, rest to rest, mu 0.06",
            GaitProblem.transfer(robot, 3, mu=0.06, torque_limit=TORQUE, end_rate=0.0),
        ),
    )
    figure, axes = drawing.sheet(len(kinds), height=1.75)
    for axis, (name, problem) in zip(axes[:, 0], kinds, strict=True):
        draw_robots(axis, problem, solve(problem).best)
        axis.set_title(name, loc="left", fontsize=9.5, color=theme.INK, pad=4)
    return drawing.png(figure, "Link by link, at equal times")


def main(arguments: list[str] | None = None) -> None:
    """Measure, draw, and put the tables into the page."""
    parser = options("gaits", __doc__)
    parser.add_argument("--episodes", type=int, default=48)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, metavar="PART")
    parser.add_argument("--docs", default=str(DOCS), help="where page and pictures are")
    given: argparse.Namespace = parser.parse_args(arguments)
    robot, docs = BipedParams.from_bars(), Path(given.docs)
    parts = {
        "fastest": lambda: fastest(robot),
        "thrift": lambda: thrift(robot),
        "accuracy": lambda: accuracy(robot),
        "again": lambda: again(robot),
        "replays": lambda: replays(robot),
        "baselines": lambda: baselines(given.episodes),
    }
    content = kept_parts(given.out, PARTS if set(given.only) < set(PARTS) else ())
    for name in given.only:
        content[name] = {"rows": parts[name]()}
        write_json(content, given.out)
        print(markdown(shown(content[name]["rows"])))
    page = docs / "gaits.md"
    for name in given.only:
        marks = (f"<!-- {name} -->", f"<!-- end of {name} -->")
        put_between(page, markdown(shown(content[name]["rows"])), marks)
    if set(given.only) < set(PARTS):
        return
    write_whole(docs / "gaits.png", draw(content))
    write_whole(docs / "gait_links.png", draw_links(robot))


def shown(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows as a page shows them: numbers short, a dash for none."""

    def short(value: Any) -> Any:
        if not isinstance(value, float):
            return value
        return "-" if np.isnan(value) else f"{value:.4g}"

    return [{name: short(value) for name, value in row.items()} for row in rows]


if __name__ == "__main__":
    main()
