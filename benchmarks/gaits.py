"""The best gaits: speed against friction, cost of transport against speed.

    python -m benchmarks.gaits [--only PART ...] [--update] [--out FILE]

--update writes the tables of docs/gaits.md and docs/gaits.png.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.report import markdown, measured_by_command, put_between
from stickslip.dynamics.biped import BipedParams
from stickslip.envs.rendering import sheet, theme
from stickslip.optim import GaitProblem, solve
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from stickslip.optim.gait.profile import Profile

TORQUE = 4.0
MUS = (0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5, 0.7, 1.0)
SPEEDS = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)
FLOORS = {"mu 0.06": 0.06, "mu 0.2": 0.2, "foot held": None}
PAGE = Path("docs/gaits.md")


def fastest(_: bool) -> Iterator[dict[str, Any]]:
    """Fastest mean crank rate without slip by friction, and the fastest constant one [rad/s]."""
    robot = BipedParams.from_bars()
    for mu in MUS:
        problem = GaitProblem.periodic(robot, "time", mu=mu, torque_limit=TORQUE)
        found = solve(problem)
        yield {
            "mu": mu,
            "fastest": np.pi / found.held_value,
            "none above": np.pi / (found.every_bound or np.nan),
            "constant rate": constant(problem.on_grid.profiles.nodes, mu),
            "status": found.status.name,
        }


def constant(p: Profile, mu: float) -> float:
    """The fastest constant crank rate within friction and torque [rad/s], by bisection."""
    low, high = 0.0, 40.0
    for _ in range(60):
        rate = (low + high) / 2
        b, a = np.full_like(p.M, rate**2), np.zeros_like(p.M)
        friction, normal = p.friction(a, b), p.normal(a, b)
        fits = (np.abs(p.torque(a, b)) <= TORQUE) & (np.abs(friction) <= mu * normal)
        low, high = (rate, high) if np.all(fits & (normal >= 0)) else (low, rate)
    return low


def thrift(_: bool) -> Iterator[dict[str, Any]]:
    """Least energy (copper loss 0.5 W/(N m)^2) as cost of transport at each speed and floor."""
    robot = BipedParams.from_bars()
    profile = GaitProblem.periodic(robot).on_grid.profiles.nodes
    limits: dict[str, Any] = {"torque_limit": TORQUE}
    for speed in SPEEDS:
        row: dict[str, Any] = {"mean crank rate [rad/s]": speed}
        for name, mu in FLOORS.items():
            found = solve(GaitProblem.periodic(robot, "energy", mu=mu, mean_rate=speed, **limits))
            there = found.gait is not None
            row[name] = found.best.cost_of_transport(0.5) if there else None
            row[f"{name}, rate"] = found.mean_rate if there else None
        yield row | {"constant rate": constant_cost(profile, speed)}


def constant_cost(p: Profile, rate: float) -> float:
    """Cost of transport at a constant crank rate, were the floor and the motor to bear it [-]."""
    torque = p.torque(np.zeros_like(p.M), np.full_like(p.M, rate**2))[0]
    energy = np.trapezoid(np.maximum(torque, 0) + 0.5 * torque**2 / rate, p.theta[0])
    return float(energy / (p.robot.weight * p.robot.step_length))


PARTS = {"fastest": fastest, "thrift": thrift}


@sheet.styled
def draw(content: dict[str, Any]) -> bytes:
    """PNG of speed against friction and of cost against speed."""
    figure, (left, right) = sheet.make_sheet(1, 2, (sheet.WIDTH, 3.2), sharex=False)
    rows = content["fastest"]
    mu = [row["mu"] for row in rows]
    left.semilogx(mu, [r["fastest"] for r in rows], "o-", color=theme.MOTOR, label="best gait")
    rates = [row["constant rate"] for row in rows]
    left.semilogx(mu, rates, "s--", color=theme.SLIDES, label="constant crank rate")
    left.set_ylim(bottom=0)
    note = f"motor {TORQUE:g} N m"
    sheet.name_panel(left, "fastest mean crank rate [rad/s]", note, "static friction [-]")
    rows = content["thrift"]
    for name, look, colour in zip(FLOORS, ("o-", "^-", "v-"), sheet.shades(3), strict=True):
        there = [row for row in rows if row[name] is not None]
        speeds, costs = [r[f"{name}, rate"] for r in there], [r[name] for r in there]
        right.plot(speeds, costs, look, color=colour, label=name.replace("mu", "μ ="))
    rate = [row["mean crank rate [rad/s]"] for row in rows]
    costs = [row["constant rate"] for row in rows]
    right.plot(rate, costs, "s--", color=theme.SLIDES, label="constant crank rate")
    right.set_ylim(0, 0.5)
    sheet.name_panel(right, "least cost of transport [-]", "", "mean crank rate [rad/s]")
    for axis in (left, right):
        axis.legend()
    return sheet.png(figure, "Best gaits without slip")


def update(content: dict[str, Any]) -> None:
    """Write the page's tables and picture."""
    for name in PARTS:
        put_between(PAGE, markdown(content[name]), name)
    write_whole(PAGE.with_suffix(".png"), draw(content))


if __name__ == "__main__":
    measured_by_command("gaits", __doc__, PARTS, update)
