"""Rows of the trade as points of cost and error."""

from __future__ import annotations

from typing import Any, NamedTuple

from stickslip.dynamics.ugv import UGVParams

WHEEL_RADIUS = float(UGVParams().wheel_radius)
"""Of the measured vehicle [m]: errors of the rear contact are counted in it."""
SURE = {"torque_error": 1e-15, "contact_error": 1e-14}
"""[-], [m]: smaller errors are not claimed; the reference itself is off by a part of this."""


class Point(NamedTuple):
    """One setting on one track and batch; the solver as code."""

    track: str
    interpolation: str
    pieces: int | None
    solver: str
    dtype: str
    torque_error: float
    contact_error: float
    cost: float
    failed: float = 0.0
    """Share of the poses that were called failed though they are not, or the reverse."""

    @property
    def error(self) -> float:
        """The worse of both [-]."""
        return max(self.torque_error, self.contact_error / WHEEL_RADIUS)

    @property
    def checked(self) -> bool:
        """Whether it looks for hollow ground and computes the clearance."""
        return "samples=0" not in self.solver


def points_of(rows: list[dict[str, Any]], track: str, batch: int) -> list[Point]:
    """All points of a track and batch, of the ground in closed form and its tables."""
    return [
        Point(
            *(max(row[name], SURE[name]) if name in SURE else row[name] for name in Point._fields)
        )
        for row in rows
        if (row["track"], row["batch"]) == (track, batch)
    ]


def reliable(points: list[Point]) -> list[Point]:
    """Points that called no pose failed which is not: the others are cheap, but of no use."""
    return [p for p in points if p.failed == 0]


def solver_name(solver: str) -> str:
    """Out of its code: PoseSolver(samples=0, iterations=2) is "2 iterations, unchecked"."""
    inside = solver.removeprefix("PoseSolver(").removesuffix(")")
    given = dict(part.split("=") for part in inside.split(", ") if part)
    words = "adaptive"
    if "iterations" in given:
        count = int(given["iterations"])
        words = f"{count} iteration{'s' if count > 1 else ''}"
    elif "tolerance" in given:
        words = f"tolerance {float(given['tolerance']):.0e}"
    return words + (", unchecked" if "samples" in given else "")


def ground_name(point: Point) -> str:
    """The closed form, or the table with its pieces a metre."""
    return "closed form" if point.pieces is None else f"{point.interpolation} {point.pieces}/m"


def short(point: Point) -> str:
    """A label for a picture."""
    return f"{solver_name(point.solver)}\n{ground_name(point)}, {point.dtype}"
