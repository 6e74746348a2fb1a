"""The instances of the suite by id. A definition never changes: a change gets a new version."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.checks import require_choice
from stickslip.optim.gait.goal import goal_of
from stickslip.optim.posture.criteria import CRITERIA
from stickslip.optim.suite.families import design, gains, gait, posture, shooting, split
from stickslip.optim.suite.instance import Flags, Instance
from stickslip.optim.torque_split.split import SPLIT_CRITERIA

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

FAMILIES = ("posture", "split", "gait", "shooting", "gains", "design", "goals")
"""What the instances are about: see docs/suite.md."""

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
GAITS: dict[tuple[str, int], dict[str, float]] = {
    ("time", 16): {"mu": 0.2},
    ("time", 64): {"mu": 0.08},
    ("energy", 32): {"mu": 0.3, "mean_rate": 3.0},
    ("torque", 64): {"mu": 0.1, "mean_rate": 3.0},
    ("work", 128): {"mu": 0.3, "mean_rate": 5.0},
    ("friction", 32): {"mean_rate": 3.0},
}
SHOTS = (
    ("grip", 10, None),
    ("firm", 20, None),
    ("slippery", 10, None),
    ("slippery", 20, None),
    ("slippery", 40, None),
    ("icy", 20, None),
    ("patch", 20, None),
    ("slippery", 20, 0.01),
)
"""Scene, numbers, and how far the foot may slide [m]."""
GAINS = ((2, 3.0), (4, 3.0), (8, 3.0), (4, 5.0))
VEHICLES = (
    ("wheel_energy", ("bump", "sinusoid")),
    ("friction_demand", ("bump", "ramp", "sinusoid")),
)
GOALS = {
    ("bump", ("wheel_energy", "friction_demand")): 32,
    ("rough", ("wheel_energy", "peak_torque")): 32,
}


def suite(*families: str) -> dict[str, Instance]:
    """All instances by id, or those of some of FAMILIES.

    Making them costs nothing: problems are built when they are used.
    """
    for one in families:
        require_choice("family", one, FAMILIES)
    return {name: one for name, one in _all().items() if not families or one.family in families}


def instance(name: str) -> Instance:
    """One of them by its id. ValueError, with the nearest ids, for an unknown one."""
    require_choice("id", name, tuple(_all()))
    return _all()[name]


@cache
def _all() -> dict[str, Instance]:
    made = [*_postures(), *_splits(), *_gaits(), *_shots(), *_gains(), *_designs(), *_goals()]
    return {one.id: one for one in made}


def _one(name: str, build: Callable[[], Any], **rest: Any) -> Instance:
    """An instance of one goal, or of those that `build` makes."""

    def problems() -> tuple[Any, ...]:
        found = build()
        return found if isinstance(found, tuple) else (found,)

    return Instance(id=f"{name}-v1", build=problems, **rest)


def _postures() -> Iterator[Instance]:
    for (track, criterion, ends), sizes in POSTURES.items():
        for n in sizes:
            name = criterion.replace("_", "-").removeprefix("wheel-")
            yield _one(
                f"ugv-{track}-{name}{ENDS[ends]}-d{n}",
                partial(posture.posture_problem, track, criterion, n, ends),
                family="posture",
                what=f"leg angles over {track}: {criterion}, {ENDS_IN_WORDS[ends]}",
                goals=(f"{criterion} [{CRITERIA[criterion].unit}]",),
                flags=Flags(smooth=False),
                n=n,
            )


def _splits() -> Iterator[Instance]:
    for (track, criterion), n in SPLITS.items():
        yield _one(
            f"split-{track}-{criterion.replace('_', '-')}-d{n}",
            partial(split.split_problem, track, criterion, n),
            family="split",
            what=f"torque split over {track} with straight legs: {criterion}",
            goals=(f"{criterion} [{SPLIT_CRITERIA[criterion].unit}]",),
            flags=Flags(convex=True, smooth=criterion == "squared_torque", separable=True),
            n=n,
        )


def _gaits() -> Iterator[Instance]:
    for (objective, n), limits in GAITS.items():
        given = ", ".join(f"{name} {value:g}" for name, value in limits.items())
        yield _one(
            f"gait-{objective}-d{n}",
            partial(gait.gait_problem, objective, n, **limits),
            family="gait",
            what=f"the biped's periodic step without slip: {objective}, {given}",
            goals=(f"{objective} [{_gait_unit(objective)}]",),
            flags=Flags(convex=objective != "friction", smooth=False, slopes=False),
            n=n,
        )


def _shots() -> Iterator[Instance]:
    for scene, n, limit in SHOTS:
        rest = "" if limit is None else f", sliding {limit:g} m at most"
        slips = scene not in ("grip", "firm")
        yield _one(
            f"shoot-{scene}{'' if limit is None else '-limited'}-d{n}",
            partial(shooting.shooting_problem, scene, n, slide_limit=limit),
            family="shooting",
            what=f"motor torques of a walk on {scene} through the simulator{rest}",
            goals=("cost [-]",),
            flags=Flags(smooth=False, lipschitz=not slips),
            n=n,
        )


def _gains() -> Iterator[Instance]:
    for n, rate in GAINS:
        yield _one(
            f"gains-rate{rate:g}-d{n}",
            partial(gains.gains_problem, n, rate, 8),
            family="gains",
            what=f"a feedback for walking at {rate:g} rad/s on floors that are drawn",
            goals=("mean cost [-]",),
            flags=Flags(smooth=False, lipschitz=False, noisy=True),
            n=n,
        )


def _designs() -> Iterator[Instance]:
    for goal, masses in (("friction", False), ("energy", False), ("energy", True)):
        n = len(design.LENGTHS) + masses * len(design.MASSES)
        unit = {"friction": "-", "energy": "J/m"}[goal]
        yield _one(
            f"design-biped-{goal}{'-masses' if masses else ''}-d{n}",
            partial(design.biped_design, goal, masses),
            family="design",
            what=f"the lengths {'and masses ' if masses else ''}of PASIBOT: least {goal}",
            goals=(f"{goal} [{unit}]",),
            flags=Flags(smooth=False),
            n=n,
        )
    for criterion, tracks in VEHICLES:
        yield _one(
            f"design-ugv-{criterion.replace('_', '-').removeprefix('wheel-')}-d4",
            partial(design.vehicle_design, criterion, tracks),
            family="design",
            what=f"wheelbase, leg length and fixed legs of the UGV on {', '.join(tracks)}",
            goals=(f"{criterion} [{CRITERIA[criterion].unit}]",),
            flags=Flags(smooth=False),
            n=4,
        )


def _goals() -> Iterator[Instance]:
    for (track, criteria), n in GOALS.items():
        yield _one(
            f"goals-ugv-{track}-{'-'.join(one.split('_')[-1] for one in criteria)}-d{n}",
            partial(posture.posture_goals, track, criteria, n),
            family="goals",
            what=f"leg angles over {track}: {' against '.join(criteria)}",
            goals=tuple(f"{one} [{CRITERIA[one].unit}]" for one in criteria),
            flags=Flags(smooth=False),
            n=n,
        )
    yield _one(
        "goals-gait-time-energy-d32",
        partial(gait.gait_goals, ("time", "energy"), 32, mu=0.2),
        family="goals",
        what="the biped's periodic step without slip: its time against its energy, mu 0.2",
        goals=(f"time [{_gait_unit('time')}]", f"energy [{_gait_unit('energy')}]"),
        flags=Flags(convex=True, smooth=False, slopes=False),
        n=32,
    )


def _gait_unit(objective: str) -> str:
    return goal_of(objective, 0.0).unit
