"""PASIBOT as MJCF: a tree of hinges and two slots, twelve `connect` equalities, one motor.

The tree hangs on the supporting foot and goes through its tibia and lower tendon to the hip, from
there to everything else. The slots are joints of the tree (the stabiliser slides along the hip and
turns), so 12 pins are left to close and the 26 coordinates keep one degree of freedom beside the
foot's own. x forwards, z up, every frame parallel to the ground's at the initial crank angle, so
that qpos = 0 is the closed linkage. Hinges turn about -y: angles are anticlockwise seen with x to
the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BODIES, BipedParams, kinematics
from stickslip.dynamics.biped.links import LINK_OF_BODY

SLOT = "slot"

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


def _swing(body: str) -> str:
    return body if body == "8" else body + "p"


LOOPS: tuple[tuple[str, str, str], ...] = (
    *_OPEN,
    *((_swing(one), _swing(other), pin) for one, other, pin in _OPEN),
)
"""(body, body, pin) that the tree leaves open: six pins a leg."""


@dataclass(frozen=True)
class Mechanism:
    """Masses and places of everything at one crank angle; ground frame, SI units.

    mass [24], inertia [24] about the centres, centre [24, 2]: bodies in the order of BODIES, the
    payload added to the hip. slot: direction of the hip's slot [2]. heel, toe: the foot's edges
    behind and before the ankle, which is the origin.
    """

    crank_angle: float
    mass: np.ndarray
    inertia: np.ndarray
    centre: np.ndarray
    pins: dict[str, np.ndarray]
    """Pins by name: [2 legs, 2] for the legs' pins, [2] for A, B, D."""
    slot: np.ndarray
    total_mass: float
    gravity: float
    heel: float
    toe: float

    def pin(self, name: str, body: str) -> np.ndarray:
        """Place [2] of the pin `name` of the leg that `body` belongs to."""
        place = self.pins["slot_pin" if name == SLOT else name]
        return place if place.ndim == 1 else place[int(body.endswith("p"))]


def mechanism(params: BipedParams, crank_angle: float = np.pi / 2) -> Mechanism:
    """The bodies and pins of `params` at `crank_angle` [rad], from `kinematics`.

    As exact as the working precision: use 64 bits for a linkage that is to close to 1e-12.
    """
    dtype = jnp.result_type(*map(jnp.result_type, jax.tree.leaves(params)))
    placed = jax.jit(kinematics)(params, jnp.asarray(crank_angle, dtype))
    legs = {name: np.asarray(value, float) for name, value in placed.pins._asdict().items()}
    a, b, d = np.asarray(placed.hip_pins, float)
    mass = np.asarray(params.mass, float)[LINK_OF_BODY]
    mass[BODIES.index("13")] += float(np.asarray(params.payload))
    return Mechanism(
        crank_angle=float(crank_angle),
        mass=mass,
        inertia=np.asarray(params.inertia, float)[LINK_OF_BODY],
        centre=np.asarray(placed.centres, float),
        pins={**legs, "A": a, "B": b, "D": d},
        slot=(b - a) / np.linalg.norm(b - a),
        total_mass=float(params.total_mass),
        gravity=float(np.asarray(params.gravity)),
        heel=float(np.asarray(params.heel)),
        toe=float(np.asarray(params.toe)),
    )


CRANK_JOINT = "crank"
RADIUS = 0.02
"""Radius of the two spheres at the foot's edges [m]; they touch the ground at heel and toe."""


@dataclass(frozen=True)
class Settings:
    """MuJoCo's settings of time and constraints; see its documentation for the words.

    timestep [s]. solref: time constant [s] and damping ratio of the constraints.
    """

    timestep: float = 1e-3
    integrator: str = "RK4"
    solref: tuple[float, float] = (2e-3, 1.0)


def mjcf(machine: Mechanism, settings: Settings, friction: float | None = None) -> str:
    """The model as XML text. friction None: the supporting foot is part of the world (grip); else
    it moves in the plane and touches the ground at heel and toe with that coefficient.

    MuJoCo has one coefficient of friction: static and kinetic are the same.
    """
    root = ElementTree.Element("mujoco", model="pasibot")
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    _options(root, machine, settings, friction is not None)
    world = ElementTree.SubElement(root, "worldbody")
    foot = _body(world, machine, "1", np.zeros(2))
    if friction is not None:
        _ground(world, foot, machine, settings, friction)
    elements = {"1": (foot, np.zeros(2))}
    for body, parent, pin in TREE:
        above, origin = elements[parent]
        place = machine.pin(pin, body if body != "13" else parent)
        element = _body(above, machine, body, place, origin)
        if pin == SLOT:
            slide = {"type": "slide", "axis": _vector(machine.slot)}
            ElementTree.SubElement(element, "joint", {"name": f"slot{body}", **slide})
        name = CRANK_JOINT if body == "8" else f"pin{body}"
        ElementTree.SubElement(element, "joint", name=name, type="hinge", axis="0 -1 0")
        elements[body] = element, place
    equality = ElementTree.SubElement(root, "equality")
    for one, other, pin in LOOPS:
        anchor = machine.pin(pin, one) - elements[one][1]
        pinned = {"body1": f"link{one}", "body2": f"link{other}", "anchor": _vector(anchor)}
        ElementTree.SubElement(equality, "connect", {**pinned, **_softness(settings)})
    actuator = ElementTree.SubElement(root, "actuator")
    ElementTree.SubElement(actuator, "motor", name="motor", joint=CRANK_JOINT)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode")


def _options(
    root: ElementTree.Element, machine: Mechanism, settings: Settings, contacts: bool
) -> None:
    option = ElementTree.SubElement(
        root,
        "option",
        timestep=_number(settings.timestep),
        integrator=settings.integrator,
        gravity=f"0 0 {_number(-machine.gravity)}",
        cone="elliptic" if contacts else "pyramidal",
        solver="Newton",
        iterations="20",
        tolerance="1e-12",
    )
    # refsafe would raise the time constants behind our back
    ElementTree.SubElement(option, "flag", refsafe="disable", eulerdamp="disable")


def _body(
    above: ElementTree.Element,
    machine: Mechanism,
    body: str,
    place: np.ndarray,
    origin: np.ndarray | None = None,
) -> ElementTree.Element:
    """A body whose frame lies at `place`; the plane's inertia stands for all three."""
    at = place if origin is None else place - origin
    index = BODIES.index(body)
    element = ElementTree.SubElement(above, "body", name=f"link{body}", pos=_vector(at))
    ElementTree.SubElement(
        element,
        "inertial",
        pos=_vector(machine.centre[index] - place),
        mass=_number(machine.mass[index]),
        diaginertia=" ".join([_number(machine.inertia[index])] * 3),
    )
    return element


def _ground(
    world: ElementTree.Element,
    foot: ElementTree.Element,
    machine: Mechanism,
    settings: Settings,
    friction: float,
) -> None:
    """A floor, and the foot free in the plane on two spheres."""
    touch = {"condim": "3", "friction": f"{_number(friction)} 0 0", **_softness(settings)}
    floor = {"type": "plane", "size": "10 10 1", "contype": "1", "conaffinity": "2"}
    ElementTree.SubElement(world, "geom", {"name": "floor", **floor, **touch})
    for name, kind, axis in (("x", "slide", "1 0 0"), ("z", "slide", "0 0 1")):
        ElementTree.SubElement(foot, "joint", name=f"foot_{name}", type=kind, axis=axis)
    ElementTree.SubElement(foot, "joint", name="foot_turn", type="hinge", axis="0 -1 0")
    for name, edge in (("heel", -machine.heel), ("toe", machine.toe)):
        place = _vector(np.array([edge, RADIUS]))
        ball = {"type": "sphere", "size": _number(RADIUS), "mass": "0"}
        ball |= {"contype": "2", "conaffinity": "1", "pos": place}
        ElementTree.SubElement(foot, "geom", {"name": name, **ball, **touch})


def _softness(settings: Settings) -> dict[str, str]:
    return {
        "solref": " ".join(map(_number, settings.solref)),
        "solimp": "0.9999 0.9999 0.001 0.5 2",
    }


def _vector(plane: np.ndarray) -> str:
    return f"{_number(plane[0])} 0 {_number(plane[1])}"


def _number(value: float) -> str:
    return repr(float(value))
