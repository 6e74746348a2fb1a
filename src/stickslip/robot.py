"""`stickslip robot`: check a robot's or a vehicle's file, tell its numbers and draw it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics import biped
from stickslip.dynamics.biped.links import MISMATCH
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.checks import require_choice, require_number
from stickslip.dynamics.machine_file import machine_in
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams, equilibrium
from stickslip.envs.biped.picture import BipedFrame, biped_drawing
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Drawing
from stickslip.envs.rendering.linkage import Mechanism
from stickslip.envs.rendering.scene import draw_machines
from stickslip.envs.rendering.sheet import WIDTH, make_sheet, name_panel, png, styled
from stickslip.optim import GaitProblem, PostureProblem, solve
from stickslip.optim.gait.footing import Footing
from stickslip.optim.gait.gait import friction_uses
from stickslip.optim.progress import say_stage
from stickslip.optimise.biped import TORQUE_LIMIT
from stickslip.optimise.picture import vehicles_drawing
from stickslip.records.files import write_whole
from stickslip.records.table import Column, Content, Table
from stickslip.report import picture_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATES = np.arange(0.5, 10.01, 0.5)
"""Constant crank rates of the curve of friction [rad/s]."""
MOST_RATE = 40.0
POSES = 4
"""Drawn of a robot or a vehicle."""
SLOPES = np.linspace(0.0, 1.0, 21)
HEIGHTS = (0.05, 0.1, 0.15, 0.2)
"""Heights of steps of the default length, 0.5 m [m]."""
ANGLES = 31
"""Angles of each leg that are tried on a slope."""
AMPLE = 10.0
"""Friction at which no wheel slips, to ask for the least [-]."""


class Page(NamedTuple):
    """What is told of a machine. needed: least friction at each x of the curve, named `below`."""

    facts: dict[str, str]
    tables: dict[str, Table]
    drawing: Drawing
    x: np.ndarray
    needed: np.ndarray
    below: str


def robot_command(flags: Mapping[str, Any]) -> Content:
    """Check a machine's file, print its numbers and draw it; or write a template."""
    path = Path(flags["file"])
    if flags["new"]:
        template = Path(__file__).parent / "templates" / f"{flags['machine']}.toml"
        write_whole(path, template.read_bytes(), overwrite=flags["overwrite"])
        print(f"Written: {path}")
        return Content(facts={"files": [str(path)]})
    require_number("mu", flags["mu"], low=0.0, accepted="finite frictions >= 0")
    require_choice("machine", machine := machine_in(path), ("biped", "ugv"))
    make = vehicle_page if machine == "ugv" else robot_page
    picture = picture_path(flags["out"], path, flags["overwrite"])
    page = make(path, flags["changes"], flags["mu"])
    columns = [Column("name", words=True), Column("value", words=True)]
    print(Table(columns, list(page.facts.items())).terminal(head=False))
    for table in page.tables.values():
        print(table.rounded(4).terminal())
    write_whole(picture, png(draw(page), path.name), overwrite=flags["overwrite"])
    print(f"Written: {picture}")
    return Content(page.tables, {"facts": page.facts, "files": [str(picture)]})


def robot_page(path: Path, changes: Mapping[str, str], frictions: Sequence[float]) -> Page:
    """What is told of a robot: friction at constant crank rates, fastest motions."""
    with precision("float64"):
        robot, motor = biped.BipedParams.with_motor(path, changes)
        motor = {"torque_limit": TORQUE_LIMIT} | motor
        jolt = float(biped.exchange_mismatch(robot))
        footing = Footing.of(robot)
        mass, step = float(robot.total_mass), float(biped.step_length(robot))
    start, limit = footing.start_torque, motor["torque_limit"]
    weak = f", more than the motor's {limit:g} N m" if start > limit else ""
    walks = f"no, with a jolt of {jolt:.2g} crank lengths (or rad)" if jolt >= MISMATCH else "yes"
    facts = {
        "closes": "at every crank angle",
        "support changes without impact": walks,
        "total mass": f"{mass:.4g} kg",
        "step length": f"{step:.4g} m",
        "start torque": f"{start:.4g} N m, constant, from rest{weak}",
    }
    rates = friction_by_rate(footing)
    fastest = fastest_table(robot, footing, motor, frictions, jolt < MISMATCH)
    phases = np.linspace(biped.SUPPORT_START, biped.SUPPORT_END, POSES, endpoint=False)
    places = 2 * float(robot.toe + robot.heel) * np.arange(POSES)
    frames = BipedFrame(phases, floor=(), weight=1.0, floor_position=places)
    drawing = biped_drawing(frames, Mechanism(robot))
    needed = np.array([row[1] for row in rates.rows])
    tables = {"friction": rates, "fastest": fastest}
    return Page(facts, tables, drawing, RATES, needed, "constant crank rate [rad/s]")


def friction_by_rate(footing: Footing) -> Table:
    """Least friction and peak torque at constant crank rates."""
    nodes, rows = footing.profiles.nodes, []
    for rate in map(float, RATES):
        peak = float(np.max(np.abs(nodes.torque(np.zeros(1), np.array(rate**2)))))
        rows.append([rate, footing.at_rate(rate).friction, peak])
    names = (Column("rate", "rad/s"), Column("least_friction"), Column("peak_torque", "N m"))
    return Table(names, rows)


def fastest_table(
    robot: biped.BipedParams,
    footing: Footing,
    motor: Mapping[str, Any],
    frictions: Sequence[float],
    walks: bool,
) -> Table:
    """For each friction the fastest constant rate and the fastest gait without slip; no gait where
    the fastest breaks the motor's limit of power."""
    rows: list[list[Any]] = []
    for mu in frictions:
        say_stage(f"fastest gait at a friction of {mu:g}")
        gait = None
        with precision("float64"):
            constant = fastest_rate(footing, mu)
            if walks:
                found = solve(GaitProblem.periodic(robot, "time", mu=mu, **motor))
                gait = None if not found.feasible else float(found.best.mean_rate)
        rows.append([mu, constant, gait])
    heads = (Column("friction"), Column("constant_rate", "rad/s"), Column("best_gait", "rad/s"))
    return Table(heads, rows)


def fastest_rate(footing: Footing, mu: float) -> float:
    """The largest rate [rad/s] up to which a friction is enough at every constant one."""
    low, high = 0.0, MOST_RATE
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if footing.at_rate(middle).friction <= mu else (low, middle)
    return low


def vehicle_page(path: Path, changes: Mapping[str, str], frictions: Sequence[float]) -> Page:
    """What is told of a vehicle: the slopes and steps that it can pass, and at what friction."""
    vehicle, motor = UGVParams.with_motor(path, changes)
    limit = motor.get("max_torque")
    slopes = np.array([slope_friction(vehicle, float(one), limit) for one in SLOPES])
    climbs = [[mu, steepest(slopes, mu)] for mu in frictions]
    steps = []
    for height in HEIGHTS:
        say_stage(f"step of {100 * height:g} cm")
        steps.append([height, step_friction(vehicle, height, limit)])
    tables = {
        "slopes": Table((Column("friction"), Column("steepest_slope")), climbs),
        "steps": Table((Column("step", "m"), Column("least_friction")), steps),
    }
    low, high = (float(one) for one in (vehicle.leg_angle_min, vehicle.leg_angle_max))
    passed = [height for height, mu in steps if mu is not None]
    tried = f"{passed[-1]:g} m" if passed else "none"
    facts = {
        "total mass, one side": f"{float(vehicle.weight / vehicle.gravity):.4g} kg",
        "leg angles": f"{np.degrees(low):.4g} to {np.degrees(high):.4g} degrees",
        "motor": "no limit" if limit is None else f"{limit:g} N m at each wheel",
        "slopes tried": f"{SLOPES[0]:g} to {SLOPES[-1]:g}, {SLOPES[1]:g} apart",
        "highest of the steps tried": f"{tried}, smoothed over 0.5 m",
    }
    places = 4.0 + 2 * float(vehicle.body_length + 2 * vehicle.leg_length) * np.arange(POSES)
    middle = (low + high) / 2
    angles = [middle, middle, high, high, middle, high, high, middle]
    flat = PostureProblem(vehicle, Track.flat(end=places[-1] + 4.0), places)
    drawing = vehicles_drawing(flat, flat.stations(np.array(angles)), np.arange(POSES))
    return Page(facts, tables, drawing, SLOPES, slopes, "slope [-]")


def slope_friction(vehicle: UGVParams, slope: float, limit: float | None) -> float:
    """The least friction that holds the vehicle on a slope in its best posture; inf where no
    posture stands, or the motors are too weak."""
    legs = np.linspace(float(vehicle.leg_angle_min), float(vehicle.leg_angle_max), ANGLES)
    angles = np.stack(np.meshgrid(legs, legs, indexing="ij"), -1).reshape(-1, 2)
    with precision("float64"):
        found = equilibrium(vehicle, Track.incline(slope), 4.0, angles, AMPLE)
    stands = np.asarray(found.status) == Status.OK
    if limit is not None:
        stands &= np.abs(np.asarray(found.torque)) <= limit
    wheels = (found.F_rear, found.N_rear), (found.F_front, found.N_front)
    rear, front = (friction_uses(np.asarray(F), np.asarray(N)) for F, N in wheels)
    return float(np.min(np.maximum(rear, front)[stands], initial=np.inf))


def steepest(needed: np.ndarray, mu: float) -> float | None:
    """The steepest slope up to which a friction is enough, between the slopes tried linearly."""
    last = int(np.argmin(np.append(needed <= mu, False)))
    if last == 0:
        return None
    if last == len(needed) or not np.isfinite(needed[last]):
        return float(SLOPES[last - 1])
    return float(np.interp(mu, needed[last - 1 : last + 1], SLOPES[last - 1 : last + 1]))


def step_friction(vehicle: UGVParams, height: float, limit: float | None) -> float | None:
    """The least friction of a drive over a smoothed step, by dp; None where no drive passes."""
    given: dict[str, Any] = {"friction": AMPLE, "max_torque": limit}
    problem = PostureProblem.along(Track.step(height), "friction_demand", vehicle, 0.05, **given)
    found = solve(problem, "dp", polish=False)
    return None if found.x is None else float(found.value)


@styled
def draw(page: Page) -> Figure:
    """The machine in several poses over the friction that it needs."""
    figure, (machine, curve) = make_sheet(2, 1, (WIDTH, 5.4), sharex=False)
    drawing = page.drawing
    wide = float(np.ptp(drawing.points[..., 0])) + drawing.span
    draw_machines(machine, drawing, 72 * WIDTH / wide * drawing.height / 420)
    machine.axhline(float(drawing.ground[:, 1].max()), color=theme.INK, zorder=1)
    name_panel(machine, f"{POSES} poses", below="[m]")
    finite = np.isfinite(page.needed)
    curve.plot(page.x[finite], page.needed[finite])
    curve.set_ylim(0, min(2.0, 1.1 * float(max(page.needed[finite], default=1.0))))
    name_panel(curve, "least friction [-]", below=page.below)
    return figure
