"""`stickslip robot`: check a robot's or a vehicle's file, tell its numbers and draw it."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import numpy as np

from stickslip.dynamics.biped import (
    BODIES,
    BipedParams,
    InverseDynamics,
    Kinematics,
    exchange_mismatch,
    step_length,
)
from stickslip.dynamics.biped.robot_file import BARS as UNITS
from stickslip.dynamics.biped.robot_file import ROBOT
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.machine_file import machine_in
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.linkage import BARS
from stickslip.envs.rendering.sheet import legend, make_sheet, name_panel, png
from stickslip.optim import GaitProblem, solve
from stickslip.optim.gait.profile import MISMATCH
from stickslip.optim.progress import say_stage
from stickslip.optimise.biped import TORQUE_LIMIT
from stickslip.paper.start import torque_by_work
from stickslip.paper.steady import phases, poses, steady
from stickslip.records.files import require_new, require_suffix, require_writable, write_whole
from stickslip.records.table import Column, Content, Table
from stickslip.vehicle import same_scale, vehicle_page, vehicle_template

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Page: TypeAlias = "tuple[dict[str, str], dict[str, Table], Figure]"
RATES = np.arange(0.5, 10.01, 0.5)
"""Constant crank rates of the curve of friction [rad/s]."""
CELLS = 400
"""Crank angles of a step."""
MOST_RATE = 40.0
HEAD = """# A robot for stickslip: uniform bars, a hip and two feet. Every line is optional.
# Numbers are in SI units, or texts with their units: 0.04 or "40 mm".
# `stickslip robot FILE` checks the file.
machine = "biped"
payload = 0.0  # on the hip [kg]
gravity = 9.81  # [m/s^2]

[motor]
torque_limit = "4 N m"
copper_loss = 0.5  # winding loss for each torque squared [W/(N m)^2]

[bars]
"""
TAIL = """
# A link in place of its bar, as CAD gives it: mass, centre of mass from its first pin along and
# across the link, moment of inertia about the centre.
# [links.tibia]
# mass = "800 g"
# centre = ["270 mm", "0 mm"]
# inertia = "1.9e4 kg mm^2"
"""


def robot_command(flags: Mapping[str, Any]) -> Content:
    """Check a machine's file, print its numbers and draw it; or write a template."""
    path = Path(flags["file"])
    if flags["new"]:
        text = template() if flags["machine"] == "biped" else vehicle_template()
        write_whole(path, text, overwrite=False)
        print(f"Written: {path}")
        return Content(facts={"files": [str(path)]})
    picture = Path(flags["out"]) if flags["out"] else path.with_suffix(".png")
    require_suffix(picture, (".png",))
    require_new([picture], flags["overwrite"])
    require_writable([picture])
    require("matplotlib.figure")
    if machine_in(path) == "ugv":
        facts, tables, figure = vehicle_page(path, flags["changes"], flags["mu"])
    else:
        facts, tables, figure = robot_page(path, flags["changes"], flags["mu"])
    columns = [Column("name", words=True), Column("value", words=True)]
    print(Table(columns, list(facts.items())).terminal(head=False))
    for table in tables.values():
        print(table.rounded(4).terminal())
    write_whole(picture, png(figure, path.name), overwrite=flags["overwrite"])
    print(f"Written: {picture}")
    return Content(tables, {"facts": facts, "files": [str(picture)]})


def robot_page(path: Path, changes: Mapping[str, str], frictions: Sequence[float]) -> Page:
    """Facts in words, tables and the picture of a robot."""
    limit = ROBOT.read(path, changes).get("motor.torque_limit", TORQUE_LIMIT)
    with precision("float64"):
        robot = BipedParams.from_file(path, changes)
        jolt = float(exchange_mismatch(robot))
        facts, rates = facts_of(robot, jolt, limit), friction_by_rate(robot)
    fastest = fastest_table(robot, limit, frictions, jolt < MISMATCH)
    say_stage("drawing")
    return facts, {"friction": rates, "fastest": fastest}, draw(robot, rates, fastest)


def template() -> str:
    """A file of the reference robot, with every argument of `BipedParams.from_bars`."""
    lines = [HEAD]
    for name, one in inspect.signature(BipedParams.from_bars).parameters.items():
        if name not in ("dtype", "payload", "gravity"):
            value = list(one.default) if isinstance(one.default, tuple) else one.default
            lines.append(f"{name} = {value}  # [{UNITS.get(name, 'crank lengths')}]\n")
    return "".join([*lines, TAIL])


def facts_of(robot: BipedParams, jolt: float, limit: float) -> dict[str, str]:
    """Mass, step, start torque and whether it walks, in words. limit: of the motor [N m]."""
    start = torque_by_work(robot, CELLS)
    weak = f", more than the motor's {limit:g} N m" if start > limit else ""
    walks = f"no, with a jolt of {jolt:.2g} crank lengths (or rad)" if jolt >= MISMATCH else "yes"
    return {
        "closes": "at every crank angle",
        "support changes without impact": walks,
        "total mass": f"{float(robot.total_mass):.4g} kg",
        "step length": f"{float(step_length(robot)):.4g} m",
        "start torque": f"{start:.4g} N m, constant, from rest{weak}",
    }


def demand(motion: InverseDynamics) -> float:
    """The least friction coefficient that holds the foot over a step; inf where it lifts."""
    normal = np.asarray(motion.normal_force)
    if np.any(normal <= 0):
        return float("inf")
    return float(np.max(np.abs(np.asarray(motion.friction_force)) / normal))


def friction_by_rate(robot: BipedParams) -> Table:
    """Least friction and peak torque at constant crank rates."""
    rows = []
    for rate in RATES:
        motion = steady(robot, phases(CELLS), rate)
        rows.append([float(rate), demand(motion), float(np.max(np.abs(motion.torque)))])
    names = (Column("rate", "rad/s"), Column("least_friction"), Column("peak_torque", "N m"))
    return Table(names, rows)


def fastest_table(
    robot: BipedParams, limit: float, frictions: Sequence[float], walks: bool
) -> Table:
    """For each friction the fastest constant rate and the fastest gait without slip."""
    rows: list[list[Any]] = []
    for mu in frictions:
        say_stage(f"fastest gait at a friction of {mu:g}")
        gait = None
        with precision("float64"):
            constant = fastest_rate(robot, mu)
            if walks:
                found = solve(GaitProblem.periodic(robot, "time", mu=mu, torque_limit=limit))
                gait = None if found.gait is None else float(found.best.mean_rate)
        rows.append([mu, constant, gait])
    heads = (Column("friction"), Column("constant_rate", "rad/s"), Column("best_gait", "rad/s"))
    return Table(heads, rows)


def fastest_rate(robot: BipedParams, mu: float) -> float:
    """The largest rate [rad/s] up to which a friction is enough at every constant one."""

    def needs(rate: float) -> float:
        return demand(steady(robot, phases(CELLS), rate))

    low, high = 0.0, MOST_RATE
    if needs(low) > mu:
        return 0.0
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if needs(middle) <= mu else (low, middle)
    return low


def draw(robot: BipedParams, rates: Table, fastest: Table) -> Figure:
    """The robot at four phases of a step over the friction that a constant rate needs."""
    figure, axes = make_sheet(2, 4, (11, 7), heights=(3, 2), sharex=False)
    with precision("float64"):
        angles = phases(4)
        every = jax.device_get(poses(robot, angles))
    for i, axis in enumerate(axes[:4]):
        _draw_pose(axis, robot, jax.tree.map(lambda leaf, i=i: leaf[i], every))
        name_panel(axis, f"crank at {np.degrees(float(angles[i])):.0f}°", below="[m]")
    same_scale(axes[:4])
    for axis in axes[5:]:
        axis.set_visible(False)
    curve = axes[4]
    grid: Any = curve.get_gridspec()
    curve.set_subplotspec(grid[1, :])
    rate, needed, _ = zip(*rates.rows, strict=True)
    curve.plot(rate, needed, color=theme.PLAYERS[0], label="constant crank rate")
    pairs = [(mean, mu) for mu, _, mean in fastest.rows if mean is not None]
    if pairs:
        curve.plot(*zip(*pairs, strict=True), "o", color=theme.PLAYERS[1], label="best gait")
    legend(curve, loc="upper left")
    curve.set_ylim(0, min(2.0, 1.1 * max(one for one in needed if np.isfinite(one))))
    name_panel(curve, "least friction [-]", "", "mean crank rate [rad/s]")
    return figure


def _draw_pose(axis: Axes, robot: BipedParams, now: Kinematics) -> None:
    pins = now.pins._asdict() | {name: [now.hip_pins[i]] * 2 for i, name in enumerate("ABD")}
    for leg, colours in ((1, theme.SWING), (0, theme.SUPPORT)):
        for start, end, role in BARS:
            wide = theme.BAR_WIDTH[role] / 2.5
            axis.plot(
                *np.transpose([pins[start][leg], pins[end][leg]]), color=colours[role], lw=wide
            )
        turned = now.angles[BODIES.index("1p" if leg else "1")]
        ends = np.outer([-float(robot.heel), float(robot.toe)], [np.cos(turned), np.sin(turned)])
        axis.plot(*(pins["E"][leg] + ends).T, color=colours["main"], lw=3)
        axis.plot(*np.transpose([pins["A"][leg], pins["crank_pin"][leg]]), color=theme.MOTOR, lw=2)
    axis.fill(*now.hip_pins.T, color=theme.HIP, ec=theme.HIP_EDGE)
    axis.set_aspect("equal")
