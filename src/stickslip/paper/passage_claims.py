"""Claims about Fig. 25, judged by drives over the bump."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.optim import PostureResult as Solved
from stickslip.optim import Station
from stickslip.paper.result import NOT_STATED, Claim, by_construction, share_of, verdict_of

RATE = 1.0
"""Limit of the legs' turn for each metre of the front wheel [rad/m]; the chapter has none."""
HELD, LIMITED, FREE, POINTWISE = "legs held", f"up to {RATE:g} rad/m", "no limit", "point by point"
VARIATION = "torque_variation"
CRITERIA = (VARIATION, "peak_torque", "wheel_energy", "total_energy")


class Drive(NamedTuple):
    """A drive: stations at its points and values there by CRITERIA; dense, between: the same with
    points closer together, the legs turning evenly from one of its own points to the next."""

    stations: Station
    values: Mapping[str, float]
    dense: Station
    between: Mapping[str, float]

    @property
    def spacings(self) -> tuple[float, float]:
        """Of its points, and of the closer ones [m]."""
        own, closer = (float(at.x[1] - at.x[0]) for at in (self.stations, self.dense))
        return own, closer


Drives = Mapping[str, Drive]


def varies_less(drives: Drives, pair: tuple[float, float], angles: int) -> Claim:
    """pair: of the best posture held [degrees], out of a grid of so many angles a leg."""
    shares = _below(drives, (LIMITED, FREE), [one.values[VARIATION] for one in drives.values()])
    return Claim(
        "(read as: leg angles that vary make the torque vary less)",
        f"∫(dM/dx)² dx {_each(drives, VARIATION, '.0f', HELD, LIMITED, FREE)} N² m at points "
        f"{drives[HELD].spacings[0]:.2g} m apart: {_percent(shares)} below the best posture held "
        f"({pair[0]:g}/{pair[1]:g}° of {angles} x {angles})",
        by_construction(min(shares) >= 0),
        "legs held are one of the drives to choose from, so the best drive is no worse for any "
        "vehicle; by how much it is better is the finding. The chapter prints curves alone: the "
        "measure, the spacing and the limit are ours",
    )


def between(drives: Drives) -> Claim:
    """Claim about the drives between the planner's points."""
    shares = _below(drives, (LIMITED, FREE), [one.between[VARIATION] for one in drives.values()])
    own, closer = drives[HELD].spacings
    told = [f"{abs(100 * of):.0f} % {'below' if of > 0 else 'above'}" for of in shares]
    return Claim(
        "(the same, between the points)",
        f"every {closer:.2g} m, legs turning evenly between the points: "
        f"{_each(drives, VARIATION, '.0f', between=True)} N² m: {' and '.join(told)} the legs held",
        share_of(of > 0 for of in shares),
        f"a planner that sees points {own:.2g} m apart lets legs without limit swing from one to "
        "the next, and the torque goes astray on the way: what they gain holds only for legs that "
        "jump. Partly: one of the two stays below",
    )


def proved(solved: Mapping[str, tuple[Solved, Solved]]) -> Claim:
    """solved: the best path over a grid and what it leads to off the grid, by the grid in words."""
    grids = ", ".join(f"{grid.value:.0f} over {name}" for name, (grid, _) in solved.items())
    refined = [one for _, one in solved.values()]
    return Claim(
        "the minimum variation of torque",
        f"dynamic programming, the least of all paths in N² m: {grids}; from there off the grid "
        + " and ".join(f"{one.value:.0f}" for one in refined),
        NOT_STATED,
        "the first are proved for the grid and its points (every path is looked at), the last are "
        f"local optima: scp ends {' and '.join(one.status.name for one in refined)}",
    )


def wheels(drive: Drive, value: float) -> Claim:
    """That the wheels stay apart. value: of the best drive found that lets them overlap."""
    least = 1e3 * float(np.min(drive.dense.wheel_clearance))
    return Claim(
        "(the wheels)",
        f"{least:.1f} mm between the wheels or more; drives that let them overlap reach "
        f"{value:.1f} N² m at {RATE:g} rad/m, those that do not {drive.values[VARIATION]:.1f}",
        NOT_STATED,
        "the chapter prints no radius and asks for no distance. Wheels of 0.28 m overlap with both "
        "legs below 67°; no vehicle could drive that",
    )


class Peak(NamedTuple):
    """The largest torque [N m] with the legs held, and their angles [degrees]."""

    torque: float
    degrees: tuple[float, float]


def peak(
    drives: Drives,
    bottleneck: float,
    where: float,
    held: Peak,
    angles: int,
) -> Claim:
    """bottleneck, where: the torque that no posture gets below [N m], and where [m]. held: the
    lowest of a posture held."""
    shown = (HELD, LIMITED, FREE)
    rear, front = held.degrees
    return Claim(
        "(the largest torque)",
        f"{_each(drives, 'peak_torque', '.2f', *shown)} N m at the points, "
        f"{_each(drives, 'peak_torque', '.2f', *shown, between=True)} N m between them; the lowest "
        f"with the legs held {held.torque:.2f} N m at {rear:g}/{front:g}°",
        NOT_STATED,
        f"with the front wheel at {where:.1f} m no posture of {angles} x {angles} needs less than "
        f"{bottleneck:.2f} N m: turning the legs can lower the peak by "
        f"{100 * (1 - bottleneck / held.torque):.1f} %",
    )


def energy(drives: Drives) -> Claim:
    """Of the wheels' motors, and with the legs' actuators."""
    shown = (HELD, LIMITED, FREE)
    return Claim(
        "(what it costs)",
        "work of the wheels' motors "
        f"{_each(drives, 'wheel_energy', '.0f', *shown, between=True)} J; with the legs' actuators "
        f"{_each(drives, 'total_energy', '.0f', *shown, between=True)} J, both added up every "
        f"{drives[HELD].spacings[1]:.2g} m",
        NOT_STATED,
        "the chapter counts the wheels alone. Legs that turn under load work too; none is "
        "recovered here. Where the legs begin and end is free",
    )


def pointwise(drives: Drives) -> Claim:
    """Each place for itself, beside whole drives."""
    step = np.max(np.abs(np.diff(drives[POINTWISE].stations.leg_angles, axis=0)))
    alone, held = (drives[name].values[VARIATION] for name in (POINTWISE, HELD))
    better = "; here even holding the legs is better" if alone > held else ""
    return Claim(
        "angles chosen for each position alone, among all pairs",
        f"{_each(drives, VARIATION, '.0f', POINTWISE, FREE, HELD)} N² m at the points; the legs "
        f"jump up to {np.degrees(step):.0f}° in {drives[HELD].spacings[0]:.2g} m",
        NOT_STATED,
        "each place takes the torque nearest to the last one's. A sum over the drive is not least "
        f"where each part of it is{better}",
    )


def passes(drive: Drive) -> Claim:
    """That the drive holds between its points, where nothing made it."""
    at = drive.dense
    wheels = ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    need = max(float(np.max(np.abs(F) / N)) for F, N in wheels)
    load = min(float(np.min(N)) for _, N in wheels)
    own, closer = drive.spacings
    return Claim(
        "the sequence shows the UGV passing the bump",
        f"{LIMITED}, every {closer:.2g} m: |F| / N up to {need:.3f} (μ = {np.max(at.friction):g} "
        f"taken), normal forces {load:.0f} N or more, {1e3 * np.min(at.clearance):.0f} mm of "
        "clearance or more",
        verdict_of(np.all(np.asarray(at.status) == Status.OK)),
        f"at points {own:.2g} m apart the planner takes nothing else; between them nothing makes "
        "wheels grip and bear a load or the body stay clear, but they do",
    )


def _each(drives: Drives, name: str, digits: str, *which: str, between: bool = False) -> str:
    """A value of several drives in words."""
    values = {one: of.between if between else of.values for one, of in drives.items()}
    return ", ".join(f"{values[one][name]:{digits}} ({one})" for one in which or drives)


def _below(drives: Drives, which: Iterable[str], values: list[float]) -> list[float]:
    """By what share values are below that of the legs held [-]."""
    by_name = dict(zip(drives, values, strict=True))
    return [1 - by_name[one] / by_name[HELD] for one in which]


def _percent(shares: Iterable[float]) -> str:
    return " and ".join(f"{100 * share:.0f}" for share in shares) + " %"
