"""The UGV's instances, by track, criterion, size and ends."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from stickslip.optim.instances.instance import Flags, Instance, made
from stickslip.optim.instances.ugv.posture import posture_goals, posture_problem
from stickslip.optim.instances.ugv.split import split_problem
from stickslip.optim.instances.ugv.vehicle import vehicle_design
from stickslip.optim.posture.criteria import CRITERIA
from stickslip.optim.torque_split.split import SPLIT_CRITERIA

if TYPE_CHECKING:
    from collections.abc import Iterator

POSTURES: dict[tuple[str, str, str], tuple[int, ...]] = {
    ("bump", "wheel_energy", "start"): (8, 16, 32, 64, 128, 256, 512),
    ("bump", "total_energy", "start"): (64,),
    ("bump", "peak_torque", "start"): (64,),
    ("bump", "torque_variation", "start"): (64,),
    ("bump", "friction_demand", "start"): (64,),
    ("bump", "wheel_energy", "none"): (64,),
    ("bump", "wheel_energy", "both"): (64,),
    ("step", "wheel_energy", "start"): (64, 256),
    ("step", "wheel_energy", "both"): (64,),
    ("step", "peak_torque", "start"): (64,),
    ("ditch", "wheel_energy", "start"): (64, 256),
    ("ditch", "peak_torque", "start"): (64,),
    ("rough", "wheel_energy", "start"): (64, 256, 512),
    ("rough", "total_energy", "none"): (128,),
    ("rough", "grip", "start"): (64,),
    ("ramp", "wheel_energy", "start"): (32, 128),
    ("sinusoid", "peak_torque", "start"): (32,),
    ("sinusoid", "torque_variation", "start"): (64,),
}
"""Track, criterion and which ends are given: free numbers."""
ENDS = {"start": "", "none": "-free", "both": "-both"}
ENDS_IN_WORDS = {
    "start": "the legs straight down at the first waypoint",
    "none": "both ends free",
    "both": "the legs straight down at both ends",
}
SPLITS = {
    ("bump", "squared_torque"): 32,
    ("rough", "squared_torque"): 128,
    ("ramp", "peak_torque"): 32,
    ("step", "peak_torque"): 64,
}
VEHICLES = (
    ("wheel_energy", ("bump", "sinusoid")),
    ("friction_demand", ("bump", "ramp", "sinusoid")),
)
GOALS = {
    ("bump", ("wheel_energy", "friction_demand")): 32,
    ("rough", ("wheel_energy", "peak_torque")): 32,
}


def instances() -> Iterator[Instance]:
    """All of them."""
    yield from _postures()
    yield from _splits()
    yield from _designs()
    yield from _goals()


def _postures() -> Iterator[Instance]:
    for (track, criterion, ends), sizes in POSTURES.items():
        for n in sizes:
            name = criterion.replace("_", "-").removeprefix("wheel-")
            yield made(
                f"ugv-{track}-{name}{ENDS[ends]}-d{n}",
                partial(posture_problem, track, criterion, n, ends),
                family="posture",
                what=f"leg angles over {track}: {criterion}, {ENDS_IN_WORDS[ends]}",
                goals=(f"{criterion} [{CRITERIA[criterion].unit}]",),
                flags=Flags(smooth=False),
                n=n,
                version=2,
            )


def _splits() -> Iterator[Instance]:
    for (track, criterion), n in SPLITS.items():
        yield made(
            f"split-{track}-{criterion.replace('_', '-')}-d{n}",
            partial(split_problem, track, criterion, n),
            family="split",
            what=f"torque split over {track} with straight legs: {criterion}",
            goals=(f"{criterion} [{SPLIT_CRITERIA[criterion].unit}]",),
            flags=Flags(convex=True, smooth=criterion == "squared_torque", separable=True),
            n=n,
        )


def _designs() -> Iterator[Instance]:
    for criterion, tracks in VEHICLES:
        yield made(
            f"design-ugv-{criterion.replace('_', '-').removeprefix('wheel-')}-d4",
            partial(vehicle_design, criterion, tracks),
            family="design",
            what=f"wheelbase, leg length and fixed legs of the UGV on {', '.join(tracks)}",
            goals=(f"{criterion} [{CRITERIA[criterion].unit}]",),
            flags=Flags(smooth=False),
            n=4,
            version=2,
        )


def _goals() -> Iterator[Instance]:
    for (track, criteria), n in GOALS.items():
        yield made(
            f"goals-ugv-{track}-{'-'.join(one.split('_')[-1] for one in criteria)}-d{n}",
            partial(posture_goals, track, criteria, n),
            family="goals",
            what=f"leg angles over {track}: {' against '.join(criteria)}",
            goals=tuple(f"{one} [{CRITERIA[one].unit}]" for one in criteria),
            flags=Flags(smooth=False),
            n=n,
            version=2,
        )


WITHDRAWN: dict[str, str] = {
    f"{one.id.removesuffix('2')}1": "its wheels could overlap"
    for one in instances()
    if one.id.endswith("-v2")
}
"""Reasons of withdrawn instances, by id."""
