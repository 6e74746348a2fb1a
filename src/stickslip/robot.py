"""`stickslip robot`: check a robot's or a vehicle's file, tell its numbers and draw it."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    InverseDynamics,
    exchange_mismatch,
    inverse_dynamics,
    kinematics,
    step_length,
)
from stickslip.dynamics.biped.robot_file import BARS, ROBOT
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.machine_file import machine_in
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.sheet import legend, make_sheet, name_panel, png
from stickslip.optim import GaitProblem, solve
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_new, require_suffix, require_writable, write_whole
from stickslip.records.table import Column, Content, Table
from stickslip.vehicle import same_scale, vehicle_page, vehicle_template

if TYPE_CHECKING:
    from jaxtyping import Array, Float
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Page: TypeAlias = "tuple[dict[str, str], dict[str, Table], Figure]"
RATES = np.arange(0.5, 10.01, 0.5)
"""Constant crank rates of the curve of friction [rad/s]."""
CELLS, TORQUE_LIMIT = 400, 4.0
"""Crank angles of a step; torque limit where the file has none [N m]."""
MOST_RATE = 40.0
SWAPPED = 1e-4
"""Robots whose exchange of support deviates by more do not walk."""
BONES = ("E K C", "D H", "D F", "C crank_pin", "rod_pin B", "C slot_pin", "K knee_bar C_bar")
"""Pins that are joined by lines in the drawing, leg by leg."""
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
    fastest = fastest_table(robot, limit, frictions, jolt < SWAPPED)
    say_stage("drawing")
    return facts, {"friction": rates, "fastest": fastest}, draw(robot, rates, fastest)


def template() -> str:
    """A file of the reference robot, with every argument of `BipedParams.from_bars`."""
    lines = [HEAD]
    for name, one in inspect.signature(BipedParams.from_bars).parameters.items():
        if name not in ("dtype", "payload", "gravity"):
            value = list(one.default) if isinstance(one.default, tuple) else one.default
            lines.append(f"{name} = {value}  # [{BARS.get(name, 'crank lengths')}]\n")
    return "".join([*lines, TAIL])


def facts_of(robot: BipedParams, jolt: float, limit: float) -> dict[str, str]:
    """Mass, step, start torque and whether it walks, in words. limit: of the motor [N m]."""
    start = start_torque(robot)
    weak = f", more than the motor's {limit:g} N m" if start > limit else ""
    walks = f"no, with a jolt of {jolt:.2g} crank lengths (or rad)" if jolt >= SWAPPED else "yes"
    return {
        "closes": "at every crank angle",
        "support changes without impact": walks,
        "total mass": f"{float(robot.total_mass):.4g} kg",
        "step length": f"{float(step_length(robot)):.4g} m",
        "start torque": f"{start:.4g} N m, constant, from rest{weak}",
    }


def along(robot: BipedParams, rate: float) -> InverseDynamics:
    """Inverse dynamics at a constant crank rate [rad/s] without slip, over one step (eq. 18)."""
    angles = jnp.linspace(SUPPORT_START, SUPPORT_END, CELLS + 1)
    return _along(robot, angles, jnp.asarray(rate, angles.dtype))


@jax.jit
def _along(
    robot: BipedParams, angles: Float[Array, " n"], rate: Float[Array, ""]
) -> InverseDynamics:
    still = jnp.zeros((), angles.dtype)
    return jax.vmap(lambda angle: inverse_dynamics(robot, angle, rate, still))(angles)


def start_torque(robot: BipedParams) -> float:
    """The least constant torque that completes a step from rest [N m], by the balance of work.

    The crank gets past every phase if the torque is above the greatest mean slope of the potential
    energy, whose slope is the torque at rest (MODEL 1.4).
    """
    slope = np.asarray(along(robot, 0.0).torque)
    rise = np.cumsum((slope[1:] + slope[:-1]) / 2)
    return float(np.max(rise / np.arange(1, CELLS + 1)))


def demand(robot: BipedParams, rate: float) -> float:
    """The least friction coefficient that holds the foot at a constant rate; inf where it lifts."""
    forces = along(robot, rate)
    normal = np.asarray(forces.normal_force)
    if np.any(normal <= 0):
        return float("inf")
    return float(np.max(np.abs(np.asarray(forces.friction_force)) / normal))


def friction_by_rate(robot: BipedParams) -> Table:
    """Least friction and peak torque at constant crank rates."""
    rows = []
    for rate in RATES:
        peak = float(np.max(np.abs(np.asarray(along(robot, rate).torque))))
        rows.append([float(rate), demand(robot, rate), peak])
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
            constant = fastest_rate(partial(demand, robot), mu)
            if walks:
                found = solve(GaitProblem.periodic(robot, "time", mu=mu, torque_limit=limit))
                gait = None if found.gait is None else float(found.best.mean_rate)
        rows.append([mu, constant, gait])
    heads = (Column("friction"), Column("constant_rate", "rad/s"), Column("best_gait", "rad/s"))
    return Table(heads, rows)


def fastest_rate(needs: Any, mu: float) -> float:
    """The largest rate [rad/s] up to which a friction is enough at every constant one."""
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
    for axis, phase in zip(axes[:4], np.linspace(SUPPORT_START, SUPPORT_END, 5), strict=False):
        _draw_pose(axis, robot, float(phase))
        name_panel(axis, f"crank at {np.degrees(phase):.0f}°", below="[m]")
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


def _draw_pose(axis: Axes, robot: BipedParams, phase: float) -> None:
    with precision("float64"):
        now = jax.device_get(kinematics(robot, phase))
    pins = {name: np.asarray(one) for name, one in now.pins._asdict().items()}
    pins |= {name: np.stack([now.hip_pins[i]] * 2) for i, name in enumerate("ABD")}
    for leg, colours in ((1, theme.SWING), (0, theme.SUPPORT)):
        for bone in BONES:
            path = np.array([pins[name][leg] for name in bone.split()])
            wide = bone == BONES[0]
            axis.plot(*path.T, color=colours["main" if wide else "mid"], lw=3 if wide else 1.2)
        foot = now.angles[0 if leg == 0 else 13]
        along = np.array([np.cos(foot), np.sin(foot)])
        ends = pins["E"][leg] + np.outer([-float(robot.heel), float(robot.toe)], along)
        axis.plot(*ends.T, color=colours["main"], lw=3)
        axis.plot(*np.array([pins["A"][leg], pins["crank_pin"][leg]]).T, color=theme.MOTOR, lw=2)
    axis.fill(*now.hip_pins.T, color=theme.HIP, ec=theme.HIP_EDGE)
    axis.set_aspect("equal")
