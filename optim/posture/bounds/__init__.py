"""Lower bounds on the UGV's cost, over cells of leg angles, not only over a grid."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.branch import DriveBound, bound_every_drive
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__, {"branch": ("DriveBound", "bound_every_drive")}
    )

__all__ = ["DriveBound", "bound_every_drive"]
