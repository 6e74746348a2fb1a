"""The biped as files of other programs: MJCF, MuJoCo's XML, and URDF.

MJCF: a tree, twelve `connect` equalities, one motor, two feet. URDF knows trees alone: a leg's
loops are cut at six places.

x forwards, z up. Hinges turn about -y: angles are anticlockwise seen with x to the right.

The tree hangs on the foot of the first leg and goes through its tibia and lower tendon to the hip,
from there to everything else. The stabilisers slide along the hip and turn, so 12 pins are left to
close, and 26 coordinates keep one degree of freedom beside the foot's own. Every frame is parallel
to the ground's where all joints are 0, at the crank angle SUPPORT_START.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BODIES, SUPPORT_START, BipedParams, Kinematics, kinematics
from stickslip.dynamics.biped.links import LINK_OF_BODY
from stickslip.dynamics.biped.robot_file import NAMES

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.pytrees import Scalar

SLOT = "slot_pin"
FEET = ("1", "1p")

_THIGH = (("2", "1", "E"), ("3", "2", "K"), ("7", "3", "C"))
_HIP = (("4", "2", "H"), ("13", "4", "D"), ("8", "13", "A"), ("6", "13", "D"), ("9", "13", "B"))
_HIP += (("10", "13", SLOT), ("6p", "13", "D"), ("9p", "13", "B"), ("10p", "13", SLOT))
_SWING = (("4p", "13", "D"), ("2p", "4p", "H"), ("3p", "2p", "K"), ("7p", "3p", "C"))
_SWING += (("1p", "2p", "E"), ("11p", "1p", "ankle_bar"), ("5p", "11p", "knee_bar"))
_SWING += (("12p", "5p", "knee_bar"),)
_BARS = (("11", "1", "ankle_bar"), ("5", "11", "knee_bar"), ("12", "5", "knee_bar"))

TREE: tuple[tuple[str, str, str], ...] = (*_THIGH, *_HIP, *_SWING, *_BARS)
"""(body, the body it hangs on, the pin between them), depth first; the root is body 1."""

_OPEN = (("2", "5", "K"), ("10", "12", "C_bar"), ("7", "10", "C"), ("3", "6", "F"))
_OPEN += (("7", "8", "crank_pin"), ("7", "9", "rod_pin"))
_OTHER = [(f"{one}p", "8" if other == "8" else f"{other}p", pin) for one, other, pin in _OPEN]
LOOPS: tuple[tuple[str, str, str], ...] = (*_OPEN, *_OTHER)
"""(body, body, pin) that the tree leaves open: six pins a leg."""


def name_of(body: str) -> str:
    """Name in files: `tibia` of body 2, `tibia_p` of the second leg's."""
    return NAMES[int(body.rstrip("p")) - 1] + ("_p" if body.endswith("p") else "")


class Mechanism(NamedTuple):
    """Masses and places of the 24 bodies at SUPPORT_START, both feet on the floor; ground frame."""

    mass: Float[Array, " 24"]
    """In the order of BODIES, the payload in the hip's [kg]."""
    inertia: Float[Array, " 24"]
    """About the centres of mass [kg m^2]."""
    placed: Kinematics
    crank: Scalar
    """Length of the crank [m]."""
    heel: Scalar
    toe: Scalar
    gravity: Scalar

    def pin(self, name: str, body: str) -> np.ndarray:
        """Place [2] of the pin `name` of the leg that `body` belongs to."""
        if name in "ABD":
            return np.asarray(self.placed.hip_pins["ABD".index(name)], float)
        return np.asarray(getattr(self.placed.pins, name)[int(body.endswith("p"))], float)

    def pins_of(self, body: str) -> list[np.ndarray]:
        """Different places [2] of a body's pins."""
        pins = (self.pin(pin, one) for one, other, pin in TREE + LOOPS if body in (one, other))
        return list({tuple(place): place for place in pins}.values())

    def soles(self, foot: str) -> list[np.ndarray]:
        """Centres [2] of the balls at heel and toe in a foot's frame."""
        angle = float(self.placed.angles[BODIES.index(foot)])
        along, up = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        edges = -float(self.heel), float(self.toe)
        return [edge * along + self.sole_radius * up for edge in edges]

    @property
    def sole_radius(self) -> float:
        """Of the balls by which a foot touches the floor [m]."""
        return float(self.crank) * 2 / 3

    @property
    def thickness(self) -> float:
        """Radius of drawn bars [m]."""
        return float(self.crank) / 5

    @property
    def slot(self) -> np.ndarray:
        """Direction of the hip's slot [2]."""
        along = self.pin("B", "13") - self.pin("A", "13")
        return along / np.linalg.norm(along)


def mechanism(params: BipedParams) -> Mechanism:
    """The robot with its payload; traced or not."""
    mass = jnp.asarray(params.mass)[LINK_OF_BODY].at[BODIES.index("13")].add(params.payload)
    inertia = jnp.asarray(params.inertia)[LINK_OF_BODY]
    placed = _placed(params, jnp.asarray(SUPPORT_START, mass.dtype))
    return Mechanism(mass, inertia, placed, params.crank, params.heel, params.toe, params.gravity)


_placed = jax.jit(kinematics)


def joints(
    params: BipedParams, theta: Scalar, rate: Scalar
) -> tuple[Float[Array, " 25"], Float[Array, " 25"]]:
    """Positions and velocities of the tree's joints while the first foot rests, in TREE's order.

    A slot has two: its slide [m], then its turn. All are 0 at the crank angle SUPPORT_START.
    """
    start = kinematics(params, jnp.asarray(SUPPORT_START, theta.dtype))

    def positions(theta: Scalar) -> Float[Array, " 25"]:
        now, found = kinematics(params, theta), []
        turned = dict(zip(BODIES, now.angles - start.angles, strict=True))
        for body, parent, pin in TREE:
            if pin == SLOT:
                leg = int(body.endswith("p"))
                found.append(_slide(now)[leg] - _slide(start)[leg])
            turn = turned[body] - turned[parent]
            turn = (turn + np.pi) % (2 * np.pi) - np.pi
            found.append(theta - SUPPORT_START if body == "8" else turn)
        return jnp.stack(found)

    return jax.jvp(positions, (theta,), (rate,))


def _slide(placed: Kinematics) -> Float[Array, " 2"]:
    """Place of both slot pins along the slot [m]."""
    a, b, _ = placed.hip_pins
    along = b - a
    return (placed.pins.slot_pin - a) @ along / jnp.linalg.norm(along)


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
    gravity = np.array([0.0, -float(machine.gravity)])
    chosen = {"cone": "elliptic", "solver": "Newton", "iterations": "20", "tolerance": 1e-12}
    timing = {"timestep": settings.timestep, "integrator": settings.integrator}
    option = add(root, "option", **timing, gravity=gravity, **chosen)
    # refsafe would raise the time constants silently
    add(option, "flag", refsafe="disable", eulerdamp="disable")
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
        _ground(world, {foot: elements[foot][0] for foot in feet}, machine, settings, friction)
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


def _body(
    above: Element, machine: Mechanism, body: str, place: np.ndarray, origin: np.ndarray
) -> Element:
    """A body with its frame at `place`: bars between pins; all axes have the plane's inertia."""
    index = BODIES.index(body)
    element = add(above, "body", name=name_of(body), pos=place - origin)
    centre, about = np.asarray(machine.placed.centres[index]), float(machine.inertia[index])
    weighs = {"mass": float(machine.mass[index]), "diaginertia": (about,) * 3}
    add(element, "inertial", pos=centre - place, **weighs)
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


HINGES = tuple(
    (body, f"7{body[2:]}", "C") if pin == SLOT else (body, parent, pin)
    for body, parent, pin in TREE
)
"""The tree with hinges alone: the stabilisers hang on the connecting rods, free of their slots."""
CUT = (
    *(loop for loop in LOOPS if loop[2] != "C"),
    *((body, parent, pin) for body, parent, pin in TREE if pin == SLOT),
)
"""(body, body, pin) that the file leaves open."""
MISSING = """URDF is a tree. This file leaves out, and the program that reads it must add:
- the closed loops: these pins hold two links together
{cuts}
- the exchange of support: the root is the first foot; whether it is fixed or free is not said
- the law of friction between feet and floor, and the floor"""


def urdf(machine: Mechanism, torque_limit: float) -> str:
    """The tree as XML text, at the pose in which all joints are 0. torque_limit [N m]."""
    root = Element("robot", name="biped")
    root.append(ElementTree.Comment(f"\n{missing(machine)}\n"))
    places = places_of(machine)
    for body in BODIES:
        _link(root, machine, body, places[body])
    for body, parent, _ in HINGES:
        joint = add(root, "joint", name=joint_of(body), type="continuous")
        add(joint, "parent", link=name_of(parent))
        add(joint, "child", link=name_of(body))
        add(joint, "origin", xyz=places[body] - places[parent])
        add(joint, "axis", xyz="0 -1 0")
        if body == "8":
            add(joint, "limit", effort=torque_limit, velocity=1e3)
    return text_of(root)


def missing(machine: Mechanism) -> str:
    """What URDF cannot say, with each cut pin in the frame of its first link."""
    places = places_of(machine)
    cuts = []
    for one, other, pin in CUT:
        x, z = machine.pin(pin, one) - places[one]
        kind = ", along a slot of the second" if pin == SLOT else ""
        cuts.append(f"    {name_of(one)} and {name_of(other)} at ({x:.6g}, 0, {z:.6g}) m{kind}")
    return MISSING.format(cuts="\n".join(cuts))


def places_of(machine: Mechanism) -> dict[str, np.ndarray]:
    """Origin [2] of each link's frame: the pin that it hangs on [m]."""
    return {"1": np.zeros(2)} | {body: machine.pin(pin, body) for body, _, pin in HINGES}


def _link(root: Element, machine: Mechanism, body: str, place: np.ndarray) -> None:
    """A link whose frame lies at `place`; the plane's inertia stands for all three."""
    index = BODIES.index(body)
    link = add(root, "link", name=name_of(body))
    inertial = add(link, "inertial")
    add(inertial, "origin", xyz=np.asarray(machine.placed.centres[index]) - place)
    add(inertial, "mass", value=float(machine.mass[index]))
    about = float(machine.inertia[index])
    crossed = dict.fromkeys(("ixy", "ixz", "iyz"), 0.0)
    add(inertial, "inertia", ixx=about, iyy=about, izz=about, **crossed)
    start, *ends = machine.pins_of(body)
    for end in ends:
        bar, middle = end - start, (start + end) / 2 - place
        visual = add(link, "visual")
        add(visual, "origin", xyz=middle, rpy=(0.0, float(np.arctan2(*bar)), 0.0))
        shape = {"radius": machine.thickness, "length": float(np.hypot(*bar))}
        add(add(visual, "geometry"), "cylinder", **shape)
    for ball in machine.soles(body) if body in FEET else ():
        collision = add(link, "collision")
        add(collision, "origin", xyz=ball)
        add(add(collision, "geometry"), "sphere", radius=machine.sole_radius)
