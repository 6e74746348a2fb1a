"""The biped as URDF, which knows trees alone: a leg's loops are cut at six places."""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from stickslip.agents.exchange.mjcf import (
    FEET,
    LOOPS,
    SLOT,
    TREE,
    Mechanism,
    add,
    joint_of,
    name_of,
    text_of,
)
from stickslip.dynamics.biped import BODIES

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
