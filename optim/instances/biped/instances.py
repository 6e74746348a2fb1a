"""The biped's instances, by scene or objective and size."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from stickslip.dynamics.biped import RK4Split
from stickslip.optim.gait.objective import goal_of
from stickslip.optim.instances.biped.gains import gains_problem
from stickslip.optim.instances.biped.gait import gait_goals, gait_problem
from stickslip.optim.instances.biped.linkage import LENGTHS, MASSES, biped_design
from stickslip.optim.instances.biped.shooting import shooting_problem
from stickslip.optim.instances.instance import Flags, Instance, made

if TYPE_CHECKING:
    from collections.abc import Iterator

GAITS: dict[tuple[str, int, int], dict[str, float]] = {
    ("time", 16, 8): {"mu": 0.2},
    ("time", 64, 4): {"mu": 0.08},
    ("energy", 32, 16): {"mu": 0.3, "mean_rate": 3.0},
    ("torque", 64, 1): {"mu": 0.1, "mean_rate": 3.0},
    ("work", 128, 1): {"mu": 0.3, "mean_rate": 5.0},
    ("friction", 32, 8): {"mean_rate": 3.0},
}
"""Limits by objective, numbers, and points of each cell that limits hold at."""
FINE = RK4Split(substeps=2, max_events=6)
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
"""Scene, numbers, and how far the foot may slide [m]. On "firm" in FINE steps."""
GAINS = ((2, 3.0), (4, 3.0), (8, 3.0), (4, 5.0))


COARSE = "its best point missed limits, or was worth less, between the nodes"
WITHDRAWN = {
    "gait-time-d16-v1": COARSE,
    "gait-time-d64-v1": COARSE,
    "gait-energy-d32-v1": COARSE,
    "gait-friction-d32-v1": COARSE,
    "goals-gait-time-energy-d32-v1": COARSE,
    "shoot-firm-d20-v1": "its best point topples when computed finely: it ends 4e-6 m short of the "
    "foot's edge in steps of 20 ms",
    "design-biped-friction-d12-v1": "friction is greatest at the ends of a step: it did not look",
}


def instances() -> Iterator[Instance]:
    """All of them."""
    yield from _gaits()
    yield from _shots()
    yield from _gains()
    yield from _designs()
    yield from _goals()


def _gaits() -> Iterator[Instance]:
    for (objective, n, points), limits in GAITS.items():
        given = ", ".join(f"{name} {value:g}" for name, value in limits.items())
        yield made(
            f"gait-{objective}-d{n}",
            partial(gait_problem, objective, n, points, **limits),
            version=1 if points == 1 else 2,
            family="gait",
            what=f"the biped's periodic step without slip: {objective}, {given}",
            goals=(f"{objective} [{_gait_unit(objective)}]",),
            flags=Flags(convex=objective != "friction", smooth=objective in ("time", "torque")),
            n=n,
        )


def _shots() -> Iterator[Instance]:
    for scene, n, limit in SHOTS:
        rest = "" if limit is None else f", sliding {limit:g} m at most"
        slips, integrator = scene not in ("grip", "firm"), FINE if scene == "firm" else None
        yield made(
            f"shoot-{scene}{'' if limit is None else '-limited'}-d{n}",
            partial(shooting_problem, scene, n, slide_limit=limit, integrator=integrator),
            version=1 if integrator is None else 2,
            family="shooting",
            what=f"motor torques of a walk on {scene} through the simulator{rest}",
            goals=("cost [-]",),
            flags=Flags(smooth=False, lipschitz=not slips),
            n=n,
        )


def _gains() -> Iterator[Instance]:
    for n, rate in GAINS:
        yield made(
            f"gains-rate{rate:g}-d{n}",
            partial(gains_problem, n, rate, 8),
            family="gains",
            what=f"a feedback for walking at {rate:g} rad/s on floors that are drawn",
            goals=("mean cost [-]",),
            flags=Flags(smooth=False, lipschitz=False, noisy=True),
            n=n,
        )


def _designs() -> Iterator[Instance]:
    for goal, masses in (("friction", False), ("energy", False), ("energy", True)):
        n = len(LENGTHS) + masses * len(MASSES)
        unit = {"friction": "-", "energy": "J/m"}[goal]
        yield made(
            f"design-biped-{goal}{'-masses' if masses else ''}-d{n}",
            partial(biped_design, goal, masses),
            version=2 if goal == "friction" else 1,
            family="design",
            what=f"the lengths {'and masses ' if masses else ''}of PASIBOT: least {goal}",
            goals=(f"{goal} [{unit}]",),
            flags=Flags(smooth=False, lipschitz=False),
            n=n,
        )


def _goals() -> Iterator[Instance]:
    yield made(
        "goals-gait-time-energy-d32",
        partial(gait_goals, ("time", "energy"), 32, 16, mu=0.2),
        version=2,
        family="goals",
        what="the biped's periodic step without slip: its time against its energy, mu 0.2",
        goals=(f"time [{_gait_unit('time')}]", f"energy [{_gait_unit('energy')}]"),
        flags=Flags(convex=True, smooth=False),
        n=32,
    )


def _gait_unit(objective: str) -> str:
    return goal_of(objective, 0.0).unit
