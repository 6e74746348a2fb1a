"""Files of a robot: uniform bars, and links one by one. See `BipedParams.from_file`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.machine_file import MachineFile, table_of, toml_text
from stickslip.dynamics.names import LENGTHS, LINKS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

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
MOTOR = {"torque_limit": "N m", "copper_loss": "W/(N m)^2"}
WHOLE = {"payload": "kg", "gravity": "m/s^2"}
LINK = {"mass": "kg", "inertia": "kg m^2", "centre.0": "m", "centre.1": "m"}
NAMES = tuple(name.replace(" ", "_") for name in LINKS)
"""The links as a file names them, in LINKS' order."""
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


def bars_of(numbers: Mapping[str, float]) -> dict[str, Any]:
    """Arguments of `from_bars`."""
    bars: dict[str, Any] = table_of(numbers, "bars")
    centre = [bars.pop(f"hip_centre.{i}", usual) for i, usual in enumerate((1.0, -6.0))]
    whole = {name: numbers[name] for name in WHOLE if name in numbers}
    return bars | whole | {"hip_centre": tuple(centre)}


def with_own_links(numbers: Mapping[str, float], **arrays: Any) -> dict[str, np.ndarray]:
    """mass [13], centre [13, 2] and inertia [13] with the numbers of single links put in."""
    found = {name: np.array(array) for name, array in arrays.items()}
    for name, value in table_of(numbers, "links").items():
        link, field, *axis = name.split(".")
        found[field][(NAMES.index(link), *map(int, axis))] = value
    return found


def require_effect(numbers: Mapping[str, float], changes: Iterable[str]) -> None:
    """Raise ValueError for a change of the bars of a robot that is given link by link."""
    whole = all(f"links.{link}.mass" in numbers for link in NAMES)
    for name in changes:
        if whole and ROBOT.names[name].startswith("bars."):
            raise ValueError(
                f"{name} of a robot that is given link by link; accepted: its lengths and links, "
                "as robot.mass.hip"
            )


def robot_text(robot: Mapping[str, Any], motor: Mapping[str, float] | None = None) -> str:
    """A robot's fields, link by link, as TOML. ValueError for a batch of robots."""
    if np.ndim(robot["crank"]) or np.ndim(robot["mass"]) != 1:
        shape = np.shape(robot["crank"])
        raise ValueError(f"crank has shape {shape}; accepted: one robot, shape ()")
    numbers = {name: robot[name] for name in WHOLE}
    numbers |= {f"lengths.{name}": robot[name] for name in LENGTHS}
    for i, link in enumerate(NAMES):
        for field in ("mass", "centre", "inertia"):
            numbers[f"links.{link}.{field}"] = np.asarray(robot[field])[i]
    numbers |= {f"motor.{name}": value for name, value in (motor or {}).items()}
    return toml_text("biped", numbers, ABOUT)
