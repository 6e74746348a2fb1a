"""Contents of a scene, which decide what is compiled.

The *kind* of floor, walk and outputs is tree structure, hence static under jit; the friction
coefficients, edges and payload are numbers and may be traced, batched and differentiated.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any, TypedDict, Unpack, get_args

import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.names import SCENES
from stickslip.dynamics.pytrees import (
    Numbers,
    Numeric,
    pytree_dataclass,
    require_broadcast,
    require_numeric,
)

STEPS = ("continuous", "one")
OUTPUTS = ("forces", "state", "joints")


@pytree_dataclass
class Grip:
    """A floor on which the foot never slips; no slip equation is compiled."""


@pytree_dataclass
class Uniform:
    """The same dry friction everywhere: coefficients [-], mu_kinetic <= mu_static."""

    mu_static: Numeric
    mu_kinetic: Numeric


@pytree_dataclass
class Patches:
    """Friction that changes with floor position.

    edges: [n] strictly increasing floor positions [m]; mu_static, mu_kinetic: [n + 1], entry i
    holding between edges[i - 1] and edges[i] (the first before edges[0], the last after the end).
    """

    edges: Numeric
    mu_static: Numeric
    mu_kinetic: Numeric


Floor = Grip | Uniform | Patches


class SceneOptions(TypedDict, total=False):
    """Arguments of every scene's constructor beside its floor; see Scene."""

    payload: Numbers | None
    steps: str
    outputs: str


@pytree_dataclass
class Scene:
    """A floor, the length of the walk, the payload and the outputs.

    floor: Grip, Uniform or Patches. payload: mass [kg] added at the hip's centre, or None
    for none (and nothing compiled for it). steps: "continuous" walking, or "one" step that ends at
    the exchange of support. outputs: "forces" (zero-moment point and its topple check), "state"
    (neither is computed; the biped is taken not to topple) or "joints" (forces, and those of all
    68 components in the joints).
    """

    floor: Floor
    payload: Numeric | None = None
    steps: str = field(default="continuous", metadata={"static": True})
    outputs: str = field(default="forces", metadata={"static": True})

    @classmethod
    def grip(cls, **options: Unpack[SceneOptions]) -> Scene:
        """A floor without slip. Options: payload, steps, outputs."""
        return cls._with(Grip, {}, options)

    @classmethod
    def _with(cls, kind: type[Floor], numbers: dict[str, Numbers], options: SceneOptions) -> Scene:
        """A scene on a floor of these numbers, all checked."""
        checks.require_known(options, ("payload", "steps", "outputs"), "option of a scene")
        if (payload := options.get("payload")) is not None:
            options["payload"] = checks.as_number("payload", payload, **PAYLOAD)
        fields = {name: checks.as_number(name, one, **RULES[name]) for name, one in numbers.items()}
        return cls(kind(**fields), **options).validate()

    @classmethod
    def uniform(
        cls, mu_static: Numbers, mu_kinetic: Numbers | None = None, **options: Unpack[SceneOptions]
    ) -> Scene:
        """One friction everywhere; mu_kinetic defaults to mu_static."""
        mu_kinetic = mu_static if mu_kinetic is None else mu_kinetic
        return cls._with(Uniform, {"mu_static": mu_static, "mu_kinetic": mu_kinetic}, options)

    @classmethod
    def patches(
        cls,
        edges: Numbers,
        mu_static: Numbers,
        mu_kinetic: Numbers | None = None,
        **options: Unpack[SceneOptions],
    ) -> Scene:
        """Friction by floor position; see Patches. Ice from 0.3 m to 0.6 m:
        `Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5])`."""
        mu_kinetic = mu_static if mu_kinetic is None else mu_kinetic
        numbers = {"edges": edges, "mu_static": mu_static, "mu_kinetic": mu_kinetic}
        return cls._with(Patches, numbers, options)

    @classmethod
    def named(cls, name: str, **options) -> Scene:
        """One of SCENES by its name, with a scene's options.

        slippery: 0.06 static, 0.05 kinetic, on which a constant crank rate of 3 rad/s slips. wet:
        0.2, 0.15. firm: 0.5, 0.4. ice-patch: firm, with 0.05, 0.04 from 0.3 m to 0.6 m. grip: a
        floor on which nothing slips.
        """
        checks.require_choice("scene", name, SCENES)
        if name == "grip":
            return cls.grip(**options)
        if name == "ice-patch":
            return cls.patches([0.3, 0.6], [0.5, 0.05, 0.5], [0.4, 0.04, 0.4], **options)
        return cls.uniform(*FRICTIONS[name], **options)

    def validate(self) -> Scene:
        """Return self, or raise ValueError naming the field, the value and the accepted range."""
        checks.require_choice("steps", self.steps, STEPS)
        checks.require_choice("outputs", self.outputs, OUTPUTS)
        accepted = "Grip(), Uniform(...) or Patches(...)"
        checks.require_kind("floor", self.floor, get_args(Floor), accepted)
        numbers = {} if self.payload is None else {"payload": self.payload}
        numbers |= vars(self.floor)
        require_numeric(**numbers)
        if isinstance(self.floor, Patches):
            _check_patches(self.floor)
        for name, value in numbers.items():
            checks.require_number(name, value, **RULES[name])
        if isinstance(self.floor, Uniform):
            require_broadcast(**vars(self.floor))
        if isinstance(self.floor, Uniform | Patches):
            static, kinetic = self.floor.mu_static, self.floor.mu_kinetic
            concrete = checks.is_concrete(static, kinetic)
            if concrete and np.any(over := np.greater(kinetic, static)):
                given = [np.broadcast_to(one, over.shape)[over][0] for one in (kinetic, static)]
                raise ValueError(
                    f"mu_kinetic = {given[0]} exceeds mu_static = {given[1]}; accepted: "
                    f"{FRICTION['accepted']}"
                )
        return self


FRICTIONS = {"slippery": (0.06, 0.05), "wet": (0.2, 0.15), "firm": (0.5, 0.4)}
"""Static and kinetic coefficients of the named floors that are the same everywhere [-]."""


def scene_of(scene: Any) -> Scene:
    """The scene itself, or the one of that name; ValueError for anything else."""
    if isinstance(scene, str):
        checks.require_choice("scene", scene, SCENES, also="a Scene")
        return Scene.named(scene)
    checks.require_kind("scene", scene, Scene, f"a Scene, or {', '.join(map(repr, SCENES))}")
    return scene


PAYLOAD: dict[str, Any] = {"low": 0.0, "accepted": "a finite mass >= 0 [kg]"}
EDGES = "at least one floor position, all finite and strictly increasing [m]"
FRICTION: dict[str, Any] = {"low": 0.0, "accepted": "finite, 0 <= mu_kinetic <= mu_static"}
RULES: dict[str, dict[str, Any]] = {
    "payload": PAYLOAD,
    "edges": {"accepted": EDGES},
    "mu_static": FRICTION,
    "mu_kinetic": FRICTION,
}
"""Accepted range of each number of a scene."""


def _check_patches(floor: Patches) -> None:
    """Shapes are checked on the last axis, so that a batch of floors passes too."""
    edges, mu_static, mu_kinetic = map(np.shape, (floor.edges, floor.mu_static, floor.mu_kinetic))
    if len(edges) == 0 or edges[-1] == 0:
        raise ValueError(f"edges has shape {edges}; accepted: at least one floor position [m]")
    for name, shape in (("mu_static", mu_static), ("mu_kinetic", mu_kinetic)):
        if len(shape) == 0 or shape[-1] != edges[-1] + 1:
            given = f"{name} has shape {shape}"
            raise ValueError(f"{given}; accepted: one more entry than edges, here {edges[-1] + 1}")
    require_broadcast(mu_static=floor.mu_static, mu_kinetic=floor.mu_kinetic)
    checks.require_increasing("edges", floor.edges, EDGES)
