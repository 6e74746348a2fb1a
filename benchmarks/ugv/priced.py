"""Rows of the measured promises as points with their cost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from benchmarks.ugv.population import AS_FUNCTION
from benchmarks.ugv.trade import DENSE

PRICED = {"closed": ("bump", "exact"), "waves": ("rough", "exact"), "spline": ("rough", "quintic"),
          "function": ("sines", "exact")}  # fmt: skip
"""The measured track whose cost stands for a kind of ground."""
POOLED = tuple(AS_FUNCTION)
"""What a function of the user's may look like: the promise holds for each of them."""


class Promise(NamedTuple):
    """A setting on a kind of ground; the solver as code. Errors: typical, promised, worst."""

    ground: str
    place: str
    solver: str
    dtype: str
    pieces_per_wave: int | None
    poses: int
    torque: tuple[float, float, float]
    contact: tuple[float, float, float]
    wrong: int
    cost: float = 0.0

    @property
    def error(self) -> float:
        """The worse of both promised errors [-]."""
        return max(self.torque[1], self.contact[1])

    @property
    def checked(self) -> bool:
        """Whether it looks for hollow ground and computes the clearance."""
        return "samples=0" not in self.solver


def promises_of(rows: list[dict[str, Any]]) -> list[Promise]:
    """All rows but those of POOLED, and of each setting the worst of these as on a function."""
    found = [
        Promise(
            *(row[name] for name in Promise._fields[:6]),
            torque=tuple(row["torque"]),
            contact=tuple(row["contact"]),
            wrong=row["wrong"],
        )
        for row in rows
    ]
    kinds: dict[tuple, list[Promise]] = {}
    for p in found:
        if p.ground in POOLED:
            kinds.setdefault(p[1:5], []).append(p)
    own = [p for p in found if p.ground not in POOLED]
    return own + [_pooled(same) for same in kinds.values() if len(same) == len(POOLED)]


def _pooled(same: list[Promise]) -> Promise:
    def worst(name: str) -> tuple:
        return tuple(max(each) for each in zip(*(getattr(p, name) for p in same), strict=True))

    return same[0]._replace(
        ground="function",
        poses=sum(p.poses for p in same),
        torque=worst("torque"),
        contact=worst("contact"),
        wrong=sum(p.wrong for p in same),
    )


def costs_of(trade: list[dict[str, Any]]) -> Callable[[Promise], dict[int, float]]:
    """A function from a promise to its processor seconds for each measured batch."""
    table: dict[tuple, dict[int, float]] = {}
    for row in trade:
        if row["pieces"] in (None, DENSE):
            key = (row["track"], row["interpolation"], row["solver"], row["dtype"])
            table.setdefault(key, {})[row["batch"]] = row["cost"]

    def costs(point: Promise) -> dict[int, float]:
        where = PRICED["spline" if point.pieces_per_wave else point.ground]
        return table.get((*where, point.solver, point.dtype), {})

    return costs
