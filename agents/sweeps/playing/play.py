"""Playing a chunk of a sweep: what is kept of its episodes, or of its points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.playing.program import Programs
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from jaxtyping import PyTree

    from stickslip.agents.sweeps.plan import Chunk, Plan

QUANTILES = (5, 50, 95)
"""Of a summary [%]."""
ENDINGS = tuple(one.name.lower() for one in Status)
"""How an episode ended, by the number of its last status."""
FINE = ("ok", "slip_onset", "step_complete")
"""Those that are no failures."""


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
        if not self.plan.summaries:
            return found
        return summary(found, self.plan.episodes, self.plan.finished)

    def _columns(self, kept: PyTree) -> dict[str, np.ndarray]:
        """What is written of what is kept."""
        found = {name: np.asarray(getattr(kept, name)) for name in self.plan.kept_units}
        found["fell"] = np.asarray(kept.fell, bool)
        if hasattr(kept, "status"):
            found["ending"] = np.asarray(kept.status, np.int8)
        return found


def summary(
    columns: dict[str, np.ndarray], episodes: int, finished: Collection[str] = ()
) -> dict[str, np.ndarray]:
    """Of each point, from columns of its episodes [points x episodes]: count of episodes, of falls
    and of each ending; of all else mean, standard deviation (NaN of one episode) and QUANTILES.

    finished: columns that count where an episode did not fall, alone; NaN where all fell.
    """
    rows = {name: one.reshape(-1, episodes) for name, one in columns.items()}
    points = len(rows["fell"])
    found: dict[str, np.ndarray] = {
        "episodes": np.full(points, episodes, np.int32),
        "falls": rows["fell"].sum(axis=1).astype(np.int32),
    }
    fell = rows.pop("fell").astype(bool)
    if (endings := rows.pop("ending", None)) is not None:
        for number, name in enumerate(ENDINGS):
            found[name] = (endings == number).sum(axis=1).astype(np.int32)
    for name, values in rows.items():
        exact = values.astype(np.float64)
        if name in finished and fell.any():
            of_points = [_spread(row[~lost]) for row, lost in zip(exact, fell, strict=True)]
            mean, spread, *quantiles = np.transpose(of_points)
        else:
            mean, spread, *quantiles = _spread(exact)
        found |= {f"{name}_mean": mean, f"{name}_std": spread}
        found |= {
            f"{name}_q{share:02d}": one for share, one in zip(QUANTILES, quantiles, strict=True)
        }
    return found


def _spread(values: np.ndarray) -> np.ndarray:
    """Mean, standard deviation (NaN of one) and QUANTILES along the last axis; NaN of none."""
    nothing, count = np.full(values.shape[:-1], np.nan), values.shape[-1]
    if count == 0:
        return np.stack([nothing] * (2 + len(QUANTILES)))
    spread = nothing if count < 2 else values.std(axis=-1, ddof=1)
    return np.stack([values.mean(axis=-1), spread, *np.percentile(values, QUANTILES, axis=-1)])
