"""Files of a robot: uniform bars, and links one by one. See `BipedParams.from_file`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context

from stickslip.dynamics.checks import is_concrete, require_known, require_number
from stickslip.dynamics.machine_file import MachineFile, OwnMachine, in_file, table_of, toml_text
from stickslip.dynamics.names import BAR_LENGTHS, LENGTHS, LINKS, range_of

if TYPE_CHECKING:
    from stickslip.dynamics.machine_file import Changes
    from stickslip.dynamics.pytrees import Numeric

    Robot = Any
    """BipedParams, which imports this file."""

BARS = {
    "crank_length": "m",
    "bar_density": "kg/m",
    "hip_mass": "kg",
    "foot_mass": "kg",
    "foot_inertia": "kg m^2",
}
"""Arguments of `from_bars` that are no lengths in crank lengths, and their units."""
CRANKS = (*(name for name in LENGTHS if name != "crank"), "hip_span")
"""Its arguments in crank lengths."""
MOTOR = {"torque_limit": "N m", "copper_loss": "W/(N m)^2", "max_power": "W", "efficiency": ""}
WHOLE = {"payload": "kg", "gravity": "m/s^2"}
LINK = {"mass": "kg", "inertia": "kg m^2", "centre.0": "m", "centre.1": "m"}
NAMES = tuple(name.replace(" ", "_") for name in LINKS)
"""The links as a file names them, in LINKS' order."""
RTOL = 1e-5
"""Relative difference up to which a link is that of a uniform bar."""
ABOUT = """A robot: numbers in SI units, or texts with their units, as "40 mm".
lengths: between the pins, see BipedParams. links: mass, centre of mass in the link's frame and
moment of inertia about it."""


def _units() -> dict[str, str]:
    crank = "bars.crank_length"
    found = {f"bars.{name}": unit for name, unit in BARS.items()}
    found |= {f"bars.{name}": crank for name in (*CRANKS, "hip_centre.0", "hip_centre.1")}
    found |= {f"lengths.{name}": "m" for name in LENGTHS}
    found |= {f"links.{link}.{name}": unit for link in NAMES for name, unit in LINK.items()}
    return found | {f"motor.{name}": unit for name, unit in MOTOR.items()} | WHOLE


def _names() -> dict[str, str]:
    """robot.hip_mass and bars.femur (in crank lengths) are arguments of `from_bars`, robot.femur
    [m], robot.mass.femur and robot.centre.femur.x fields of BipedParams."""
    found = {name: name for name in _units() if name.startswith(("bars.", "motor."))}
    found |= {f"robot.{name}": f"bars.{name}" for name in BARS}
    found |= {f"robot.{name}": f"lengths.{name}" for name in LENGTHS}
    found |= {f"robot.{name}": name for name in WHOLE}
    for i, link in enumerate(NAMES):
        for key in (link, i):  # the index is the name of a sweep's axis
            for name in LINK:
                field, dot, axis = name.partition(".")
                found[f"robot.{field}.{key}{dot}{axis}"] = f"links.{link}.{name}"
            for place, axis in enumerate("xy"):
                found[f"robot.centre.{key}.{axis}"] = f"links.{link}.centre.{place}"
    return found


ROBOT = MachineFile("biped", "robot", _units(), _names(), {"bars.crank_length": 0.030})
"""What the file of a robot may have."""


def read_robot(kind: type[Robot], path: str | Path | None, changes: Changes) -> OwnMachine:
    """See `BipedParams.with_motor`; kind: BipedParams.

    Lengths that a file gives itself would hide a change of the bars, so there the bars are changed
    afterwards, as in `BipedParams.changed`.
    """
    require_known(changes, ROBOT.names, "number of a robot")
    given = ROBOT.read(path, {})
    later = [name for name in changes if ROBOT.names[name].startswith("bars.")]
    later = later if table_of(given, "lengths") else []
    found = ROBOT.read(path, {name: changes[name] for name in changes if name not in later})
    with in_file(path):
        robot = kind.from_bars(**_arguments(found))
        own = {name: one for name, one in found.items() if name.startswith(("lengths.", "links."))}
        robot = _with_fields(robot, own) if own else robot
        for name in later:
            value = ROBOT.read(None, {name: changes[name]})[ROBOT.names[name]]
            before, robot = robot, changed_robot(robot, {name: value})
            if all(map(np.array_equal, vars(before).values(), vars(robot).values())):
                raise ValueError(f"{name} changes nothing; accepted: a number of its links")
        robot = robot.astype(jnp.result_type(robot.mass)) if own else robot
        motor = table_of(found, "motor")
        for name, value in motor.items():
            require_number(f"motor.{name}", value, **range_of(name))
    return OwnMachine(robot, motor)


def changed_robot(robot: Robot, changes: Mapping[str, Numeric]) -> Robot:
    """See `BipedParams.changed`."""
    require_known(changes, ROBOT.names, "number of a robot")
    places = {ROBOT.names[name]: value for name, value in changes.items()}
    bars = {name: value for name, value in places.items() if name.startswith("bars.")}
    robot = _with_bars(robot, bars) if bars else robot
    fields = {name: value for name, value in places.items() if name not in bars}
    return _with_fields(robot, fields) if fields else robot


def _with_bars(robot: Robot, changes: Mapping[str, Numeric]) -> Robot:
    """Arguments of `from_bars` changed; a link that is no uniform bar keeps its numbers."""
    usual, dtype = bars_of(robot), jnp.result_type(robot.mass)

    def made(bars: Mapping[str, Numeric]) -> Robot:
        return robot.from_bars(**_arguments({**usual, **bars}), dtype=dtype)

    with eval_context():  # numbers, also inside a trace of the changes
        before = made({})
        old = {name: jnp.asarray(usual[name], dtype) for name in changes}
        _, slopes = jax.jvp(made, (old,), (jax.tree.map(jnp.ones_like, old),))
    alike = [
        np.isclose(getattr(robot, name), getattr(before, name), RTOL, 0.0).reshape(13, -1)
        for name in ("mass", "centre", "inertia")
    ]
    plain = np.concatenate(alike, axis=1).all(axis=1) | (np.arange(13) == NAMES.index("foot"))
    follows = {"mass": plain, "centre": plain[:, None], "inertia": plain}
    after, found = made(changes), {}
    for name, own in vars(robot).items():
        slope, past, new = (getattr(of, name) for of in (slopes, before, after))
        moves = (np.asarray(slope) != 0) | (past != new)
        found[name] = jnp.where(moves & follows.get(name, True), new, own)
    return robot.replace(**found)


def bars_of(robot: Robot) -> dict[str, float]:
    """The arguments of `from_bars` of a robot, by their names in a file, in float64.

    bar_density: of most of its bars. ValueError for a batch of robots.
    """
    _require_single(vars(robot))
    of = {name: np.asarray(value, np.float64) for name, value in vars(robot).items()}
    crank, mass = of["crank"], of["mass"]
    length = np.array([of[name] for name in BAR_LENGTHS])
    length[NAMES.index("crank") - 1] *= 2
    density = mass[1:-1][length > 0] / length[length > 0]
    most = np.argmax(np.isclose(density[:, None], density, RTOL, 0.0).sum(axis=0))
    span = np.sqrt(12 * of["inertia"][-1] / mass[-1]) if mass[-1] > 0 else 0.0
    ahead, above = of["centre"][-1] / crank
    found = {name: of[name] / crank for name in LENGTHS if name != "crank"}
    found |= {"crank_length": crank, "bar_density": density[most], "hip_span": span / crank}
    found |= {"hip_mass": mass[-1], "foot_mass": mass[0], "foot_inertia": of["inertia"][0]}
    found |= {"hip_centre.0": ahead, "hip_centre.1": above}
    return {f"bars.{name}": float(value) for name, value in found.items()}


def _arguments(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `from_bars`."""
    bars: dict[str, Any] = table_of(numbers, "bars")
    centre = [bars.pop(f"hip_centre.{i}", usual) for i, usual in enumerate((1.0, -6.0))]
    whole = {name: numbers[name] for name in WHOLE if name in numbers}
    return bars | whole | {"hip_centre": tuple(centre)}


def _with_fields(robot: Robot, numbers: Mapping[str, Any]) -> Robot:
    """Lengths, payload, gravity and single numbers of links put in, by their names in a file."""
    found: dict[str, Any] = {}
    for place, value in numbers.items():
        table, *name = place.split(".")
        field = name[1] if table == "links" else (name or [table])[0]
        require_number(place, value, **range_of(field))
        if table != "links":
            found[field] = value
            continue
        link, _, *axis = name
        at, array = (NAMES.index(link), *map(int, axis)), found.get(field, getattr(robot, field))
        if is_concrete(array, value):
            array = np.array(array)
            array[at] = value
        else:
            array = jnp.asarray(array).at[at].set(value)
        found[field] = array
    return robot.replace(**found)


def _require_single(robot: Mapping[str, Any]) -> None:
    """Raise ValueError for a batch of robots."""
    if np.ndim(robot["crank"]) or np.ndim(robot["mass"]) != 1:
        shape = np.shape(robot["crank"])
        raise ValueError(f"crank has shape {shape}; accepted: one robot, shape ()")


def robot_text(robot: Mapping[str, Any], motor: Mapping[str, float] | None = None) -> str:
    """A robot's fields, link by link, as TOML. ValueError for a batch of robots."""
    _require_single(robot)
    numbers = {name: robot[name] for name in WHOLE}
    numbers |= {f"lengths.{name}": robot[name] for name in LENGTHS}
    for i, link in enumerate(NAMES):
        for field in ("mass", "centre", "inertia"):
            numbers[f"links.{link}.{field}"] = np.asarray(robot[field])[i]
    numbers |= {f"motor.{name}": value for name, value in (motor or {}).items()}
    return toml_text("biped", numbers, ABOUT)
