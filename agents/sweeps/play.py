"""Playing a chunk of a sweep: what is kept of its episodes, or of its points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.program import Programs
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import PyTree

    from stickslip.agents.sweeps.plan import Chunk, Plan

QUANTILES = (5, 50, 95)
"""Of a summary [%]."""
ENDINGS = tuple(one.name.lower() for one in Status)
"""How an episode ended, by the number of its last status."""


class StoppedError(Exception):
    """Playing was asked to stop."""


class Player:
    """Plays chunks of a plan. Threads may share it: the programs are compiled once."""

    def __init__(self, plan: Plan):
        self.plan = plan
        measures = plan.machine.task_measures(plan.cases[0].env)
        self.programs = Programs(plan.machine.swept(), measures.keep, plan.independent)
        self._places = [one.place for one in plan.cases]

    def play(
        self,
        chunk: Chunk,
        device: PyTree = None,
        advance: Callable[[int], None] = lambda count: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> dict[str, np.ndarray]:
        """Columns of a chunk: of its episodes, [points x episodes], point after point; or of its
        points, see `summary`. advance: told of episodes as they are played. StoppedError where
        `stop` says so."""
        case, parts = self.plan.cases[chunk.case], []
        for tile, own in self.plan.tiles(chunk):
            if stop():
                raise StoppedError
            kept = self.programs.play(case, self._places[chunk.case], tile, device)
            parts.append({name: one[:own] for name, one in self._columns(kept).items()})
            advance(own)
        found = {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}
        return summary(found, self.plan.episodes) if self.plan.summaries else found

    def _columns(self, kept: PyTree) -> dict[str, np.ndarray]:
        """What is written of what is kept."""
        found = {name: np.asarray(getattr(kept, name)) for name in self.plan.kept_units}
        found["fell"] = np.asarray(kept.fell, bool)
        if hasattr(kept, "status"):
            found["ending"] = np.asarray(kept.status, np.int8)
        return found


def summary(columns: dict[str, np.ndarray], episodes: int) -> dict[str, np.ndarray]:
    """Of each point, from columns of its episodes [points x episodes]: count of episodes, of falls
    and of each ending; of all else mean, standard deviation (NaN of one episode) and QUANTILES."""
    rows = {name: one.reshape(-1, episodes) for name, one in columns.items()}
    points = len(rows["fell"])
    found: dict[str, np.ndarray] = {
        "episodes": np.full(points, episodes, np.int32),
        "falls": rows.pop("fell").sum(axis=1).astype(np.int32),
    }
    if (endings := rows.pop("ending", None)) is not None:
        for number, name in enumerate(ENDINGS):
            found[name] = (endings == number).sum(axis=1).astype(np.int32)
    for name, values in rows.items():
        exact = values.astype(np.float64)
        spread = np.full(points, np.nan) if episodes < 2 else exact.std(axis=1, ddof=1)
        quantiles = np.percentile(exact, QUANTILES, axis=1)
        found |= {f"{name}_mean": exact.mean(axis=1), f"{name}_std": spread}
        found |= {
            f"{name}_q{share:02d}": one for share, one in zip(QUANTILES, quantiles, strict=True)
        }
    return found
