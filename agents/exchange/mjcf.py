"""The biped as MJCF, MuJoCo's XML: a tree, twelve `connect` equalities, one motor, two feet.

x forwards, z up. Hinges turn about -y: angles are anticlockwise seen with x to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from stickslip.agents.exchange.mechanism import FEET, LOOPS, SLOT, TREE, Mechanism, name_of
from stickslip.dynamics.biped import BODIES

MOTOR = "motor"
COLOURS = ("0.8 0.4 0.3 1", "0.3 0.5 0.8 1")
"""Of the first and the second leg."""
ABOUT = """ The biped of stickslip. All joints are 0 where both feet are on the floor.
MuJoCo has one coefficient of friction: static and kinetic friction are the same.
A contact that sticks creeps slowly; pins and floor are soft with the time constant solref. """


@dataclass(frozen=True)
class Settings:
    """MuJoCo's settings of time and constraints; see its documentation for the words.

    timestep [s]. solref: time constant [s] and damping ratio of the constraints.
    """

    timestep: float = 1e-3
    integrator: str = "implicitfast"
    solref: tuple[float, float] = (2e-3, 1.0)


def mjcf(
    machine: Mechanism,
    settings: Settings = Settings(),
    friction: float | None = 0.5,
    feet: tuple[str, ...] = FEET,
    torque_limit: float | None = None,
) -> str:
    """The model as XML text.

    friction: coefficient between floor and feet; None: the first foot is part of the world. feet:
    bodies that touch the floor, on spheres at heel and toe. torque_limit: of the motor [N m].
    """
    root = Element("mujoco", model="biped")
    root.append(ElementTree.Comment(ABOUT))
    least = {"boundmass": 1e-9, "boundinertia": 1e-12}  # MuJoCo moves no body without mass
    add(root, "compiler", angle="radian", autolimits="true", **least)
    _options(root, machine, settings)
    world = add(root, "worldbody")
    add(world, "light", pos=(0.0, -2.0, 3.0), dir=(0.0, 0.6, -1.0), directional="true")
    elements = {"1": (_body(world, machine, "1", np.zeros(2), np.zeros(2)), np.zeros(2))}
    for body, parent, pin in TREE:
        above, origin = elements[parent]
        place = machine.pin(pin, body)
        element = _body(above, machine, body, place, origin)
        if pin == SLOT:
            slide = {"type": "slide", "axis": machine.slot}
            add(element, "joint", name=f"{name_of(body)}_slide", **slide)
        add(element, "joint", name=joint_of(body), type="hinge", axis="0 -1 0")
        elements[body] = element, place
    if friction is not None:
        bodies = {foot: elements[foot][0] for foot in feet}
        _ground(world, bodies, machine, settings, friction)
    equality = add(root, "equality")
    for one, other, pin in LOOPS:
        pinned = {"body1": name_of(one), "body2": name_of(other)}
        anchor = machine.pin(pin, one) - elements[one][1]
        add(equality, "connect", **pinned, anchor=anchor, **_softness(settings))
    limit = {} if torque_limit is None else {"ctrlrange": (-torque_limit, torque_limit)}
    add(add(root, "actuator"), "motor", name=MOTOR, joint=joint_of("8"), **limit)
    return text_of(root)


def _ground(
    world: Element,
    bodies: dict[str, Element],
    machine: Mechanism,
    settings: Settings,
    friction: float,
) -> None:
    """A floor, the first foot free in the plane, and spheres at heel and toe of all `bodies`."""
    touch = {"condim": "3", "friction": (friction, 0.0, 0.0), **_softness(settings)}
    floor = {"type": "plane", "size": "10 10 1", "contype": "1", "conaffinity": "0"}
    add(world, "geom", name="floor", rgba="0.8 0.8 0.8 1", **floor, **touch)
    for name, kind, axis in (("x", "slide", "1 0 0"), ("z", "slide", "0 0 1")):
        add(bodies["1"], "joint", name=f"foot_{name}", type=kind, axis=axis)
    add(bodies["1"], "joint", name="foot_turn", type="hinge", axis="0 -1 0")
    ball = {"type": "sphere", "mass": "0", "contype": "0", "conaffinity": "1", **touch}
    for foot, element in bodies.items():
        for end, place in zip(("heel", "toe"), machine.soles(foot), strict=True):
            name = f"{name_of(foot)}_{end}"
            add(element, "geom", name=name, pos=place, size=machine.sole_radius, **ball)


def joint_of(body: str) -> str:
    """Name of the hinge by which a body hangs on the tree."""
    return f"{name_of(body)}_pin"


def _options(root: Element, machine: Mechanism, settings: Settings) -> None:
    option = add(
        root,
        "option",
        timestep=settings.timestep,
        integrator=settings.integrator,
        gravity=np.array([0.0, -float(machine.gravity)]),
        cone="elliptic",
        solver="Newton",
        iterations="20",
        tolerance=1e-12,
    )
    # refsafe would raise the time constants silently
    add(option, "flag", refsafe="disable", eulerdamp="disable")


def _body(
    above: Element, machine: Mechanism, body: str, place: np.ndarray, origin: np.ndarray
) -> Element:
    """A body whose frame lies at `place`, drawn as bars between its pins; the plane's inertia
    stands for all three."""
    index = BODIES.index(body)
    element = add(above, "body", name=name_of(body), pos=place - origin)
    add(
        element,
        "inertial",
        pos=np.asarray(machine.placed.centres[index]) - place,
        mass=float(machine.mass[index]),
        diaginertia=(float(machine.inertia[index]),) * 3,
    )
    first, *others = (end - place for end in machine.pins_of(body))
    for end in others:
        drawn = {"type": "capsule", "mass": "0", "contype": "0", "conaffinity": "0"}
        bar = (*_around(first), *_around(end))
        colour = COLOURS[body.endswith("p")]
        add(element, "geom", fromto=bar, size=machine.thickness, rgba=colour, **drawn)
    return element


def _softness(settings: Settings) -> dict[str, object]:
    return {"solref": settings.solref, "solimp": "0.9999 0.9999 0.001 0.5 2"}


def _around(plane: np.ndarray) -> tuple[float, float, float]:
    return float(plane[0]), 0.0, float(plane[1])


def add(above: Element, tag: str, **values: object) -> Element:
    """A new element: text stays, numbers are written in full, an array [2] is a vector (x, z)."""
    return ElementTree.SubElement(above, tag, {name: _text(one) for name, one in values.items()})


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, np.ndarray):
        value = _around(value)
    return " ".join(repr(float(one)) for one in (value if isinstance(value, tuple) else (value,)))


def text_of(root: Element) -> str:
    """The document, indented."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"
