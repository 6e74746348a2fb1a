"""The UGV's leg angles over a track: the problem, its criteria, and the methods made for it."""

from stickslip.optim.posture.criteria import CRITERIA, Criterion, Weighted, criterion_by_name
from stickslip.optim.posture.problem import PostureProblem
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.station import Station, station

__all__ = [
    "CRITERIA",
    "Criterion",
    "PostureProblem",
    "PostureResult",
    "Station",
    "Weighted",
    "criterion_by_name",
    "station",
]
