"""Lengths that kinematics needs of a robot; see BipedParams."""

from __future__ import annotations

from typing import Protocol

from stickslip.dynamics.numeric import Numeric


class Linkage(Protocol):
    """Lengths [m], and the links' centres of mass [13, 2] [m]."""

    @property
    def crank(self) -> Numeric: ...

    @property
    def ground_link(self) -> Numeric: ...

    @property
    def rod(self) -> Numeric: ...

    @property
    def rod_pin(self) -> Numeric: ...

    @property
    def rocker(self) -> Numeric: ...

    @property
    def tendon_drop(self) -> Numeric: ...

    @property
    def upper_tendon(self) -> Numeric: ...

    @property
    def lower_tendon(self) -> Numeric: ...

    @property
    def femur(self) -> Numeric: ...

    @property
    def femur_pin(self) -> Numeric: ...

    @property
    def tibia(self) -> Numeric: ...

    @property
    def tibia_pin(self) -> Numeric: ...

    @property
    def stabiliser(self) -> Numeric: ...

    @property
    def slot_depth(self) -> Numeric: ...

    @property
    def offset(self) -> Numeric: ...

    @property
    def centre(self) -> Numeric: ...
