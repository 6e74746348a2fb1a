"""Two sweeps side by side: what changed where, for the policies and points that both have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.registry import machine_by_name
from stickslip.agents.sweeps.design import SAMPLE
from stickslip.agents.sweeps.files.directory import read_about
from stickslip.agents.sweeps.reading import SweepArrays, sweep_arrays
from stickslip.agents.sweeps.telling.regions import where
from stickslip.agents.sweeps.telling.told import PLAINLY, Told
from stickslip.agents.sweeps.telling.words import (
    APART,
    BEST,
    alone,
    difference_error,
    draws,
    error_of,
    slip_of,
    summary_table,
)
from stickslip.records.content import Content
from stickslip.records.files import write_whole
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stickslip.agents.machine import Options

CLOSE = 1e-9
"""Values of an axis that differ by less, of its greatest, are one."""


class Common(NamedTuple):
    """Two sweeps at the points that both have, dimension by dimension. renamed: what each called
    a task or a policy where both have only one, and not the same."""

    one: SweepArrays
    other: SweepArrays
    renamed: dict[str, tuple[str, str]]


def compare_command(given: Options) -> Content:
    """`stickslip compare`: print the differences in words, write every point if asked; return the
    differences, a row a task and policy."""
    names = (given["one"], given["other"])
    abouts = [read_about(name) for name in names]
    machines = {str(one.definition["machine"]) for one in abouts}
    if len(machines) > 1:
        raise ValueError(
            f"sweeps of {' and '.join(sorted(machines))}; accepted: of one machine's policies"
        )
    out = None if given["out"] is None else Path(given["out"])
    if out is not None and out.exists() and not given["overwrite"]:
        raise ValueError(f"{out} exists; accepted: a new path, or --overwrite to replace it")
    both = common(*(sweep_arrays(name, summaries=True) for name in names))
    told = machine_by_name(machines.pop()).swept().told
    print(compare_in_words(both, told, names))
    if out is not None:
        print(f"Written: {write_whole(out, compare_table(both, told).csv())}")
    about = {"A": names[0], "B": names[1], "renamed": both.renamed}
    files = [] if out is None else [str(out)]
    return Content({"differences": summary_of(both, told)}, about | {"files": files})


def common(one: SweepArrays, other: SweepArrays) -> Common:
    """Both at the points that they share. ValueError where they have other axes, or no point."""
    if one.dims != other.dims:
        raise ValueError(
            f"axes {', '.join(one.dims[2:]) or 'none'} and {', '.join(other.dims[2:]) or 'none'}; "
            "accepted: two sweeps with the same axes"
        )
    renamed: dict[str, tuple[str, str]] = {}
    places: list[tuple[np.ndarray, np.ndarray]] = []
    for dim in one.dims:
        a, b = one.coordinates[dim], other.coordinates[dim]
        if dim == SAMPLE:
            _require_samples(one, other)
        first, second = _shared(a, b)
        if dim in ("task", "policy") and not len(first) and len(a) == len(b) == 1:
            renamed[dim] = (str(a[0]), str(b[0]))
            first = second = np.zeros(1, int)
        if not len(first):
            raise ValueError(
                f"no {dim} that both have: {_listed(a)} and {_listed(b)}; accepted: sweeps that "
                "share points"
            )
        places.append((first, second))
    picked = [tuple(one[i] for one in places) for i in (0, 1)]
    return Common(_picked(one, picked[0]), _picked(other, picked[1]), renamed)


def compare_in_words(both: Common, told: Told, names: tuple[str, str] = ("first", "second")) -> str:
    """How the second differs from the first, task by task and policy by policy."""
    one = both.one
    points = int(np.prod(one["episodes"].shape[2:]))
    lines = [f"A = {names[0]}", f"B = {names[1]}", f"{points} points that both have"]
    lines += [f"{dim}: {a} in A, {b} in B" for dim, (a, b) in both.renamed.items()]
    for at, task in enumerate(one.coordinates["task"]):
        lines.append(f"{task}:")
        lines += [f"  {words}" for words in _alone(both, at)]
        for which, policy in enumerate(one.coordinates["policy"]):
            lines += [f"  {policy}:", *_policy(both, at, which, told)]
    return "\n".join(lines)


def summary_of(both: Common, told: Told) -> Table:
    """A row for each task and policy: shares of its points where either earns more, told apart;
    then of either sweep what `summary_table` says."""
    parts = [summary_table(one, told) for one in both[:2]]
    own = ("task", "policy", "points")
    heads = [Column(name, words=name != "points") for name in own]
    heads += [Column("A_earns_more"), Column("B_earns_more"), Column("not_told_apart")]
    kept = [i for i, one in enumerate(parts[0].columns) if one.name not in (*own, BEST)]
    for label, part in zip("AB", parts, strict=True):
        heads += [replace(part.columns[i], name=f"{part.columns[i].name}_{label}") for i in kept]
    rows = []
    policies = len(both.one.coordinates["policy"])
    for place, (first, second) in enumerate(zip(parts[0].rows, parts[1].rows, strict=True)):
        change, apart = _change(both, *divmod(place, policies))
        shares = [(change < 0) & apart, (change > 0) & apart, ~apart]
        row = [*first[:3], *(float(share.mean()) for share in shares)]
        rows.append(row + [part[i] for part in (first, second) for i in kept])
    return Table(heads, rows)


def compare_table(both: Common, told: Told = PLAINLY) -> Table:
    """A row for each common point: its axes, and of either sweep return and failures."""
    one, other = both.one, both.other
    count = one["episodes"].size
    columns: dict[str, list[str] | list[float]] = {}
    grid = np.meshgrid(*(one.coordinates[dim] for dim in one.dims), indexing="ij")
    for dim, values in zip(one.dims, grid, strict=True):
        columns[dim] = values.reshape(count).tolist()
    for name in (n for n in one.coordinates if n not in one.dims):
        drawn = one.coordinates[name][np.asarray(columns[SAMPLE], int)]
        columns[name] = drawn.tolist()
    for label, found in (("A", one), ("B", other)):
        columns[f"return {label}"] = found["reward_mean"].reshape(count).tolist()
        columns[f"{told.failures} {label}"] = (
            (found["falls"] / found["episodes"]).reshape(count).tolist()
        )
    units = [one.units.get(name, "-") for name in columns]
    heads = [Column(name, unit) for name, unit in zip(columns, units, strict=True)]
    return Table(heads, list(zip(*columns.values(), strict=True)))


def _policy(both: Common, at: int, which: int, told: Told) -> Iterator[str]:
    means = [one["reward_mean"][at, which] for one in both[:2]]
    change, apart = _change(both, at, which)
    dims = both.one.dims[2:]
    yield f"    mean return {means[0].mean():.3g} in A, {means[1].mean():.3g} in B"
    for name, better in (("B", (change > 0) & apart), ("A", (change < 0) & apart)):
        if better.any():
            place = where(better.astype(float), dims, both.one)
            yield (
                f"    {name} earns more at {100 * better.mean():.0f} % of the points"
                + (f", most where {place}" if place else "")
                + f"; by {np.abs(change[better]).max():.3g} at most"
            )
    if not apart.all():
        yield f"    not told apart at {100 * (~apart).mean():.0f} % of the points"
    a, b = ((one["falls"] / one["episodes"])[at, which] for one in both[:2])
    words = f"    {told.failures} {100 * a.mean():.2g} % in A, {100 * b.mean():.2g} % in B"
    for name, more in (("B", b - a), ("A", a - b)):
        if more.max() > 0 and (place := where(np.maximum(more, 0), dims, both.one)):
            words += f"; more in {name} where {place}"
    yield words
    slips = [slip_of(one, told.slip) for one in both[:2]]
    if slips[0] is not None and slips[1] is not None:
        worst = [_worst(one[at, which]) for one in slips if one is not None]
        yield f"    slides at worst {worst[0]} in A, {worst[1]} in B"


def _alone(both: Common, at: int) -> list[str]:
    """What single episodes tell; that every difference is real only where it is so of both."""
    said = [alone(one, at) for one in both[:2] if draws(one, at) is not False]
    return list(dict.fromkeys(filter(None, said))) if said else [alone(both.one, at)]


def _change(both: Common, at: int, which: int) -> tuple[np.ndarray, np.ndarray]:
    """By how much the second earns more at each point, and whether the two are told apart."""
    change = both.other["reward_mean"][at, which] - both.one["reward_mean"][at, which]
    errors = [error_of(one, at)[which] for one in both[:2]]
    returns = [None if one.returns is None else one.returns[at, which] for one in both[:2]]
    return change, np.abs(change) > APART * difference_error(errors, returns)


def _worst(slips: np.ndarray) -> str:
    known = slips[np.isfinite(slips)]
    return f"{known.max():.2g} m a metre" if known.size else "unknown: it goes nowhere"


def _shared(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of the labels that both have, in each."""
    if a.dtype.kind in "US":
        same = a[:, None] == b[None, :]
    else:
        most = max(np.abs(a).max(), np.abs(b).max(), 1e-300)
        same = np.abs(a[:, None] - b[None, :]) <= CLOSE * most
    first, second = np.nonzero(same)
    return first, second


def _require_samples(one: SweepArrays, other: SweepArrays) -> None:
    """ValueError unless the random axes drew the same values."""
    for name in (n for n in one.coordinates if n not in one.dims):
        drawn = other.coordinates.get(name)
        if drawn is None or not np.array_equal(one.coordinates[name], drawn):
            raise ValueError(
                f"random axis {name} drew other values; accepted: sweeps with the same random "
                "axes, samples and design seed"
            )


def _picked(found: SweepArrays, places: tuple[np.ndarray, ...]) -> SweepArrays:
    """At these places of every dimension."""
    arrays = {name: one[np.ix_(*places)] for name, one in found.arrays.items()}
    own = dict(zip(found.dims, places, strict=True))
    labels = {
        name: one[own[name]] if name in own else one for name, one in found.coordinates.items()
    }
    returns = None if found.returns is None else found.returns[np.ix_(*places)]
    return replace(found, coordinates=labels, arrays=arrays, returns=returns)


def _listed(labels: np.ndarray) -> str:
    shown = ", ".join(f"{one:g}" if labels.dtype.kind == "f" else str(one) for one in labels[:4])
    return shown + (", ..." if len(labels) > 4 else "")
