"""The UGV's leg angles over a track: the problem, its criteria, and the methods made for it."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.branch import DriveBound, bound_every_drive
    from stickslip.optim.posture.criteria import CRITERIA, Criterion, Weighted, criterion_by_name
    from stickslip.optim.posture.problem import PostureProblem
    from stickslip.optim.posture.result import PostureResult
    from stickslip.optim.posture.station import Station, station
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "bounds.branch": ("DriveBound", "bound_every_drive"),
            "criteria": ("CRITERIA", "Criterion", "Weighted", "criterion_by_name"),
            "problem": ("PostureProblem",),
            "result": ("PostureResult",),
            "station": ("Station", "station"),
        },
    )

__all__ = [
    "CRITERIA",
    "Criterion",
    "DriveBound",
    "PostureProblem",
    "PostureResult",
    "Station",
    "Weighted",
    "bound_every_drive",
    "criterion_by_name",
    "station",
]
