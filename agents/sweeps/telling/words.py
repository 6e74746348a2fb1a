"""A sweep in words: where it fails, where it slips, which policy is best where."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.shown_names import shown_name
from stickslip.agents.sweeps.playing.play import ENDINGS, FINE
from stickslip.agents.sweeps.telling.regions import where
from stickslip.agents.sweeps.telling.told import PLAINLY, Told
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from stickslip.agents.sweeps.reading import SweepArrays

APART = 1.96
"""Standard errors of a difference beyond which two means are told apart."""
SLIPS = 0.01
"""Sliding by more than this share of the way is told of [m/m]."""
NO_WAY = 0.1
"""Mean way below which nothing is said per metre [m]."""
BEST = "best_told_apart"
"""Share of the points at which a policy is the best, and told from the next one."""


def in_words(found: SweepArrays, told: Told = PLAINLY) -> str:
    """What a sweep's summaries say."""
    lines: list[str] = []
    for at, task in enumerate(found.coordinates["task"]):
        lines += [f"{task}:", *_task(found, at, told)]
    return "\n".join(lines) + "\n"


def summary_table(found: SweepArrays, told: Told = PLAINLY) -> Table:
    """The same in numbers: a row a task and policy, over all its points; see `in_words`.

    point_mean_least, point_mean_most: of the means that its points have. Failures and BEST are
    shares.
    """
    slips = slip_of(found, told.slip)
    heads = [Column(name, words=True) for name in ("task", "policy")]
    heads += [Column("points"), Column("episodes")]
    heads += [Column("return_mean"), Column("point_mean_least"), Column("point_mean_most")]
    heads += [Column(told.failures), Column(BEST)]
    heads += [] if slips is None else [Column("slip_worst", "m/m")]
    rows = []
    for at, task in enumerate(found.coordinates["task"]):
        best, apart = best_of(found, at) if len(found.coordinates["policy"]) > 1 else (None, None)
        for which, policy in enumerate(found.coordinates["policy"]):
            episodes, mean = found["episodes"][at, which], found["reward_mean"][at, which]
            row = [str(task), str(policy), int(mean.size), int(episodes.sum())]
            row += [float(mean.mean()), float(mean.min()), float(mean.max())]
            row.append(float((found["falls"][at, which] / episodes).mean()))
            row.append(None if best is None else float(((best == which) & apart).mean()))
            if slips is not None:
                known = slips[at, which][np.isfinite(slips[at, which])]
                row.append(float(known.max()) if known.size else None)
            rows.append(row)
    return Table(heads, rows)


def slip_of(found: SweepArrays, slip: tuple[str, str] | None) -> np.ndarray | None:
    """Sliding over the way at every point, NaN where there is none; None where nothing slides."""
    if slip is None or f"{slip[0]}_mean" not in found.arrays:
        return None
    slid, way = (found[f"{name}_mean"] for name in slip)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.abs(way) >= NO_WAY, slid / np.abs(way), np.nan)


def measured(found: SweepArrays, at: int, told: Told) -> list[tuple[str, str, np.ndarray]]:
    """What is told of a task: title, unit and value at every point [policies, ...]; the sliding
    where there is any way."""
    shown = [
        ("mean return", "-", found["reward_mean"][at]),
        (told.failures, "%", 100 * found["falls"][at] / found["episodes"][at]),
    ]
    if (slips := slip_of(found, told.slip)) is not None and np.isfinite(slips[at]).any():
        shown.append(("distance slid", "m/m", slips[at]))
    return shown


def best_of(found: SweepArrays, at: int) -> tuple[np.ndarray, np.ndarray]:
    """The policy with the greatest mean return at every point of a task, by its place, and whether
    it is told apart from the next one (95 %, see `difference_error`)."""
    mean, error = found["reward_mean"][at], error_of(found, at)
    order = np.argsort(-mean, axis=0, kind="stable")
    pair = order[:1], order[1:2]
    lead = np.subtract(*(np.take_along_axis(mean, one, 0) for one in pair))
    errors = [np.take_along_axis(error, one, 0) for one in pair]
    returns = [
        None if found.returns is None else np.take_along_axis(found.returns[at], one[..., None], 0)
        for one in pair
    ]
    return pair[0][0], (lead > APART * difference_error(errors, returns))[0]


def difference_error(
    errors: Sequence[np.ndarray], returns: Sequence[np.ndarray | None]
) -> np.ndarray:
    """Standard error of the difference of two mean returns at every point.

    errors: see `error_of`. returns: of every episode [..., episodes]; an episode's two are of the
    same draw, so that the error is of their difference. Without them the episodes are taken as
    independent, which finds fewer differences.
    """
    one, other = returns
    apart = np.sqrt(errors[0] + errors[1])
    if one is None or other is None or one.shape != other.shape or one.shape[-1] < 2:
        return apart
    change = np.asarray(other, float) - one
    return np.where(apart > 0, change.std(axis=-1, ddof=1) / np.sqrt(change.shape[-1]), 0.0)


def error_of(found: SweepArrays, at: int) -> np.ndarray:
    """Squared standard error of every mean return of a task [policies, ...].

    0 where no reset draws: every difference is real. Infinite of one episode where one draws, or
    where that is not known: nothing is told apart.
    """
    count = found["episodes"][at]
    if draws(found, at) is False:
        return np.zeros(count.shape)
    return np.where(count > 1, np.nan_to_num(found["reward_std"][at]) ** 2 / count, np.inf)


def draws(found: SweepArrays, at: int) -> bool | None:
    """Whether a task's resets draw, None where that is not known."""
    return None if found.drawn is None else str(found.coordinates["task"][at]) in found.drawn


def alone(found: SweepArrays, at: int) -> str:
    """What one episode a point tells, '' where there are more and resets draw."""
    drawn = draws(found, at)
    if drawn is False:
        return "no reset draws anything: every difference is real"
    if found["episodes"][at].max() > 1:
        return ""
    why = "resets draw" if drawn else "whether resets draw is not known"
    return f"one episode a point, and {why}: nothing is told apart"


def _task(found: SweepArrays, at: int, told: Told) -> Iterator[str]:
    policies, dims = found.coordinates["policy"], found.dims[2:]
    failed = found["falls"][at] / found["episodes"][at]
    slips = slip_of(found, told.slip)
    names = [shown_name(str(policy)) for policy in policies]
    width = max(map(len, names))
    for which, policy in enumerate(names):
        head = f"  {policy:<{width}}  "
        mean = found["reward_mean"][at, which].mean()
        ends = _failures(found, at, which, failed[which], told.fails)
        yield f"{head}mean return {mean:.3g}; {ends}"
        if slips is not None:
            yield f"  {'':<{width}}  {_slips(found, slips[at, which], dims)}"
    if len(policies) > 1:
        yield from _best(found, at, dims)


def _failures(found: SweepArrays, at: int, which: int, failed: np.ndarray, fails: str) -> str:
    share = float(failed.mean())
    if share == 0:
        return f"never {fails}"
    text = f"{fails} in {100 * share:.2g} % of the episodes"
    if place := where(failed, found.dims[2:], found):
        text += f", most where {place}"
    counts = {name: int(found[name][at, which].sum()) for name in ENDINGS if name in found.arrays}
    ends = {name: n for name, n in counts.items() if n and name not in FINE}
    if ends:
        most = max(ends, key=lambda name: ends[name])
        text += f"; {100 * ends[most] / sum(ends.values()):.0f} % of them {most.replace('_', ' ')}"
    return text


def _slips(found: SweepArrays, slips: np.ndarray, dims: tuple[str, ...]) -> str:
    known = np.isfinite(slips)
    if not known.any():
        return "goes nowhere"
    much = np.where(known, slips > SLIPS, False)
    if not much.any():
        return f"slides nowhere by more than {100 * SLIPS:g} cm a metre"
    text = (
        f"slides by more than {100 * SLIPS:g} cm a metre at {100 * much.mean():.0f} % of the points"
    )
    if place := where(much.astype(float), dims, found):
        text += f", most where {place}"
    return text + f"; at worst {np.nanmax(slips):.2g} m a metre"


def _best(found: SweepArrays, at: int, dims: tuple[str, ...]) -> Iterator[str]:
    best, apart = best_of(found, at)
    for which, policy in enumerate(map(shown_name, map(str, found.coordinates["policy"]))):
        own = (best == which) & apart
        if own.any():
            place = where(own.astype(float), dims, found)
            yield (
                f"  best by return: {policy} at {100 * own.mean():.0f} % of the points"
                + (f", most where {place}" if place else "")
            )
    if said := alone(found, at):
        yield f"  {said}"
    if (even := float((~apart).mean())) > 0:
        words = "two are best" if draws(found, at) is False else "no best told from the next"
        yield f"  {words} at {100 * even:.0f} % of the points"
