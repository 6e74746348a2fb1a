"""Scores of a named task beside the other columns of an evaluation."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, TypeAlias

from stickslip.agents.evaluation.columns import Column

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    import numpy as np
    from jaxtyping import Array

    from stickslip.agents.evaluation.run import Measures
    from stickslip.agents.evaluation.statistics import Interval
    from stickslip.envs.tasks.known import Known

AnyMeasures: TypeAlias = "Measures[Any, Any, Any]"
"""Of whichever machine."""


class _Played(Protocol):
    """Kept data of every machine's episodes."""

    @property
    def reward(self) -> Array | np.ndarray: ...


FIRST = "return"
"""The column that scores stand behind."""
OWN = ("task_score", "gap")
"""The columns of scores."""


def scored(
    measures: AnyMeasures, known: Known, unit: str, seeds: Sequence[int] | None = None
) -> AnyMeasures:
    """The measures with the columns task_score and gap.

    unit: of the task's returns. seeds: of the episodes to come; None for others than the task's.
    """

    def score(played: _Played) -> Interval:
        return known.score(played.reward, seeds)

    def gap(played: _Played) -> Interval:
        return known.gap(played.reward, seeds)

    columns = ((Column("score", "-", 3), score), (Column("gap", unit, 2), gap))
    own = dict(zip(OWN, columns, strict=True))
    rest = dict(measures.columns)
    return replace(measures, columns={FIRST: rest.pop(FIRST), **own, **rest})


def in_words(known: Known, unit: str) -> str:
    """Text of what 0 and 1 are, and of the proved bounds, under assumptions and without."""
    unit = "" if unit == "-" else f" {unit}"
    words = (
        f"score 0: {known.trivial.policy}, {known.trivial.value:.4g}{unit}; 1: the best known, "
        f"{known.best.value:.4g}{unit} over {known.episodes} episode"
        f"{'s' if known.episodes > 1 else ''}, earned in replay by {known.how}, no proof that no "
        "more can be"
    )
    if known.assumed is not None:
        one = known.assumed
        words += f"; proved under assumptions: at most {one.value:.4g}{unit}, by {one.reason}"
    if known.bound is None:
        return words + "; no bound is known"
    return f"{words}; proved: at most {known.bound.value:.4g}{unit}, as {known.bound.reason}"
