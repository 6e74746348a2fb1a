"""Files of a robot: uniform bars, and links one by one. See `BipedParams.from_file`."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_known, shown
from stickslip.dynamics.machine_file import (
    Table,
    in_file,
    number_or_text,
    numbers_of,
    quantity,
    read_machine,
    table_of,
    toml_text,
)
from stickslip.dynamics.names import LENGTHS, LINKS

if TYPE_CHECKING:
    from pathlib import Path

TABLES = ("bars", "lengths", "links", "motor", "payload", "gravity")
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
LINK = {"mass": "kg", "centre": "m", "inertia": "kg m^2"}
MOTOR = {"torque_limit": "N m", "copper_loss": "W/(N m)^2"}
WHOLE = {"payload": "kg", "gravity": "m/s^2"}
NAMES = tuple(name.replace(" ", "_") for name in LINKS)
"""The links as a file names them, in LINKS' order."""
ABOUT = """A robot: numbers in SI units, or texts with their units, as "40 mm".
lengths: between the pins, see BipedParams. links: mass, centre of mass in the link's frame and
moment of inertia about it."""


class RobotFile(NamedTuple):
    """What a file says of a robot, in SI units and crank lengths."""

    bars: dict[str, Any]
    """Arguments of `from_bars`."""
    lengths: dict[str, float]
    """Fields of BipedParams."""
    links: dict[str, dict[str, Any]]
    """Masses, centres and inertias of single links."""
    motor: dict[str, float]
    """torque_limit [N m] and copper_loss [W/(N m)^2], where they are given."""

    def own_links(self, **arrays: Any) -> dict[str, np.ndarray]:
        """mass [13], centre [13, 2] and inertia [13] with the numbers of single links put in."""
        found = {name: np.array(array) for name, array in arrays.items()}
        for link, numbers in self.links.items():
            for key, value in numbers.items():
                row = found[key][NAMES.index(link)]
                found[key][NAMES.index(link)] = np.where(np.isnan(value), row, value)
        return found


def read_robot(path: str | Path | None, changes: Mapping[str, Any] | None = None) -> RobotFile:
    """Read a robot's file, see `BipedParams.from_file`; None: nothing but the changes."""
    tables = {} if path is None else read_machine(path, "biped", TABLES)
    with in_file(path):
        found = _read(tables)
    return _read(changed(tables, changes)) if changes else found


def _read(tables: Table) -> RobotFile:
    whole = {name: quantity(name, tables[name], WHOLE[name]) for name in WHOLE if name in tables}
    lengths = numbers_of(table_of(tables, "lengths"), dict.fromkeys(LENGTHS, "m"), "lengths")
    motor = numbers_of(table_of(tables, "motor"), MOTOR, "motor")
    links = table_of(tables, "links")
    require_known(links, NAMES, "link")
    found = {name: _link(name, table_of(links, name)) for name in links}
    return RobotFile(_bars(table_of(tables, "bars")) | whole, lengths, found, motor)


def _bars(table: Table) -> dict[str, Any]:
    """Arguments of `from_bars`: a text with a unit is a length in crank lengths afterwards."""
    require_known(table, (*BARS, *CRANKS, "hip_centre"), "entry of [bars]")
    found: dict[str, Any] = numbers_of(
        {name: one for name, one in table.items() if name in BARS}, BARS, "bars"
    )
    crank = found.get("crank_length", 0.030)

    def cranks(name: str, value: Any) -> float:
        if isinstance(value, str):
            return quantity(f"bars.{name}", value, "m") / (crank or np.nan)
        return quantity(f"bars.{name}", value, "")

    for name in table.keys() - BARS.keys() - {"hip_centre"}:
        found[name] = cranks(name, table[name])
    if "hip_centre" in table:
        found["hip_centre"] = tuple(
            cranks("hip_centre", one) for one in _pair("bars.hip_centre", table["hip_centre"])
        )
    return found


def _link(name: str, table: Table) -> dict[str, Any]:
    """Numbers of one link; NaN for the coordinate of a centre that a change left alone."""
    require_known(table, LINK, f"entry of [links.{name}]")
    found: dict[str, Any] = {}
    for key, value in table.items():
        place, unit = f"links.{name}.{key}", LINK[key]
        if key == "centre":
            parts = _pair(place, value)
            found[key] = [np.nan if v is None else quantity(place, v, unit) for v in parts]
        else:
            found[key] = quantity(place, value, unit)
    return found


def _pair(name: str, value: Any) -> list[Any]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError(f"{name} = {shown(value)}; accepted: a pair, [x, y]")
    return list(value)


def changed(tables: Table, changes: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a file with single numbers changed, by the names of `PLACES`.

    Values as in a file, or their texts. ValueError for an unknown name.
    """
    found: dict[str, Any] = deepcopy(dict(tables))
    require_known(changes, PLACES, "number of a robot")
    for name, value in changes.items():
        *path, last = PLACES[name]
        entry: Any = found
        for word in path:
            if word == "centre" and word not in entry:
                entry[word] = [None, None]
            entry = entry.setdefault(word, {})
        entry[last] = number_or_text(value)
    return found


def _places() -> dict[str, tuple[str | int, ...]]:
    found: dict[str, tuple[str | int, ...]] = {}
    for i, name in enumerate(NAMES):
        for key in (name, str(i)):  # the index is the name of a sweep's axis
            found |= {f"robot.{one}.{key}": ("links", name, one) for one in ("mass", "inertia")}
            for j, axis in enumerate("xy"):
                place = ("links", name, "centre", j)
                found |= {f"robot.centre.{key}.{axis}": place, f"robot.centre.{key}.{j}": place}
    found |= {f"bars.{name}": ("bars", name) for name in (*BARS, *CRANKS)}
    found |= {f"motor.{name}": ("motor", name) for name in MOTOR}
    lengths = {f"robot.{name}": ("lengths", name) for name in LENGTHS}
    whole = {f"robot.{name}": (name,) for name in WHOLE}
    return {f"robot.{name}": ("bars", name) for name in BARS} | lengths | whole | found


PLACES = _places()
"""Where a file has the number of a dotted name: robot.hip_mass and bars.femur (in crank lengths)
are arguments of `from_bars`, robot.femur [m] and robot.mass.femur fields of BipedParams."""


def robot_text(robot: Mapping[str, Any]) -> str:
    """A robot's fields, link by link, as TOML. ValueError for a batch of robots."""
    if np.ndim(robot["crank"]) or np.ndim(robot["mass"]) != 1:
        shape = np.shape(robot["crank"])
        raise ValueError(f"crank has shape {shape}; accepted: one robot, shape ()")
    arrays = (np.asarray(robot[key]) for key in ("mass", "centre", "inertia"))
    links = {
        name: {"mass": m, "centre": list(c), "inertia": i}
        for name, m, c, i in zip(NAMES, *arrays, strict=True)
    }
    whole = {"machine": "biped", **{name: robot[name] for name in WHOLE}}
    lengths = {name: robot[name] for name in LENGTHS}
    return toml_text(whole | {"lengths": lengths, "links": links}, ABOUT)
