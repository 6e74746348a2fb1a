"""A population of trainings as a page: what each member earns, and what was lost on the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.reports.show import View
from stickslip.envs.rendering.html.colours import PLAYERS
from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Float

RETURN = "return"
MOST_ROWS = 64
"""Members of a table, the best of them."""


def population_view(
    losses: Mapping[str, Float[np.ndarray, "members updates"]], members: int, timesteps: int
) -> View:
    """losses: of every update, see Population; timesteps: of each member."""
    facts = [("members", f"{members:,}"), ("trained", f"{timesteps:,} steps each")]
    updates = max((one.shape[1] for one in losses.values()), default=0)
    facts.append(("updates", f"{updates:,}"))
    x = timesteps / max(updates, 1) * np.arange(1, updates + 1)
    table = _table(losses)
    names = sorted(losses, key=lambda name: name != RETURN)
    return View(
        Page(
            f"A population of {members} trainings",
            facts=tuple(facts),
            tables=() if table is None else (("By return, highest first", table),),
            curves=tuple(
                Curve("steps", x, Panel(_title(name), "-", _lines(losses[name]))) for name in names
            ),
        )
    )


def _title(name: str) -> str:
    return "return of training episodes" if name == RETURN else name.replace("_", " ")


def _lines(values: np.ndarray) -> tuple[Line, ...]:
    """A line a member; of more than there are colours the least, the median and the greatest."""
    if len(values) <= len(PLAYERS):
        return tuple(Line(f"member {i}", one) for i, one in enumerate(values))
    known = np.isfinite(values).any(axis=0)
    shares = {"greatest": 100, "median": 50, "least": 0}
    found = np.full((len(shares), values.shape[1]), np.nan)
    found[:, known] = np.nanpercentile(values[:, known], list(shares.values()), axis=0)
    return tuple(Line(name, one) for name, one in zip(shares, found, strict=True))


def _table(losses: Mapping[str, np.ndarray]) -> Table | None:
    """Returns by member, the highest last one first; None where no episode tells of one."""
    if RETURN not in losses or not np.isfinite(losses[RETURN]).any():
        return None
    rows = []
    for member, found in enumerate(losses[RETURN]):
        known = found[np.isfinite(found)]
        if len(known):
            rows.append((member, known[-1], known.max()))
    rows.sort(key=lambda row: -row[1])
    heads = [Column("member"), Column("return at the end"), Column("highest return")]
    return Table(heads, [(i, f"{a:.4g}", f"{b:.4g}") for i, a, b in rows[:MOST_ROWS]])
