"""Interval arithmetic on arrays, rounded outwards, and derivatives of it."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.optim.intervals.arithmetic import Interval, hull, interval
    from stickslip.optim.intervals.jet import Jet
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__, {"arithmetic": ("Interval", "hull", "interval"), "jet": ("Jet",)}
    )

__all__ = ["Interval", "Jet", "hull", "interval"]
