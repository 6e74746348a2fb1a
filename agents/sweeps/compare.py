"""Two sweeps side by side, at the points that both have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.sweeps.axes import SAMPLE
from stickslip.agents.sweeps.data import SweepArrays, sweep_arrays
from stickslip.agents.sweeps.statistics import half_width, is_random
from stickslip.agents.sweeps.store import read_head
from stickslip.records.content import Content
from stickslip.records.files import write_whole
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from stickslip.agents.machine import Options

CLOSE = 1e-9
"""Relative difference of two values of an axis that are taken as equal."""


class Common(NamedTuple):
    """Two sweeps at their common points. renamed: task or policy, where each has only one and
    calls it otherwise."""

    a: SweepArrays
    b: SweepArrays
    renamed: dict[str, tuple[str, str]]


def compare_command(given: Options) -> Content:
    """`stickslip compare`: print the differences, write every point if asked for."""
    names = (given["one"], given["other"])
    machines = {str(read_head(Path(name), "sweep")["definition"]["machine"]) for name in names}
    if len(machines) > 1:
        raise ValueError(f"sweeps of {' and '.join(sorted(machines))}; accepted: of one machine")
    out = None if given["out"] is None else Path(given["out"])
    if out is not None and out.exists() and not given["overwrite"]:
        raise ValueError(f"{out} exists; accepted: a new path, or --overwrite to replace it")
    both = common(*map(sweep_arrays, names))
    table = differences(both)
    print(f"A = {names[0]}\nB = {names[1]}")
    for what, (a, b) in both.renamed.items():
        print(f"{what}: {a} in A, {b} in B")
    print(table.rounded(4).terminal(), end="")
    if out is not None:
        print(f"Written: {write_whole(out, point_table(both).csv())}")
    facts = {"A": names[0], "B": names[1], "renamed": both.renamed}
    return Content({"differences": table}, facts | {"files": [] if out is None else [str(out)]})


def common(a: SweepArrays, b: SweepArrays) -> Common:
    """Select the common points. ValueError where axes or samples differ, or no point is common."""
    if a.dims != b.dims:
        raise ValueError(
            f"axes {', '.join(a.dims[2:-1]) or 'none'} and {', '.join(b.dims[2:-1]) or 'none'}; "
            "accepted: two sweeps with the same axes"
        )
    for name in (one for one in a.coordinates if one not in a.dims):
        drawn = b.coordinates.get(name)
        if drawn is None or not np.array_equal(a.coordinates[name], drawn):
            raise ValueError(
                f"random axis {name} has other samples; accepted: sweeps with the same random "
                "axes, samples and design seed"
            )
    renamed: dict[str, tuple[str, str]] = {}
    places: list[tuple[np.ndarray, np.ndarray]] = []
    for dim in a.dims[:-1]:
        one, other = a.coordinates[dim], b.coordinates[dim]
        first, second = _shared(one, other)
        if dim in ("task", "policy") and not len(first) and len(one) == len(other) == 1:
            renamed[dim] = (str(one[0]), str(other[0]))
            first = second = np.zeros(1, int)
        if not len(first):
            raise ValueError(
                f"no common {dim}: {_listed(one)} and {_listed(other)}; accepted: sweeps that "
                "share points"
            )
        places.append((first, second))
    first, second = zip(*places, strict=True)
    return Common(_picked(a, first), _picked(b, second), renamed)


def differences(both: Common) -> Table:
    """A row for each task and policy: mean returns, their difference B - A with its 95 % interval
    (paired by seeds), shares of points where either earns significantly more, and failures."""
    heads = [Column(name, words=True) for name in ("task", "policy")]
    names = ("points", "return_A", "return_B", "difference", "low", "high")
    names += ("A_earns_more", "B_earns_more", "failures_A", "failures_B")
    rows = []
    for t, task in enumerate(both.a.coordinates["task"]):
        for p, policy in enumerate(both.a.coordinates["policy"]):
            a, b = (one["reward"][t, p].astype(float) for one in both[:2])
            change = b.mean(axis=-1) - a.mean(axis=-1)
            half = half_width(a, b, _random(both, t))
            first, second = (one.reshape(-1, one.shape[-1]).mean(axis=0)[None] for one in (a, b))
            value = float(change.mean())
            error = float(half_width(first, second, _random(both, t))[0])
            fell = [float(one["fell"][t, p].mean()) for one in both[:2]]
            shares = [float(np.mean(change < -half)), float(np.mean(change > half))]
            row = [change.size, float(a.mean()), float(b.mean()), value, value - error]
            rows.append([str(task), str(policy), *row, value + error, *shares, *fell])
    return Table([*heads, *map(Column, names)], rows)


def point_table(both: Common) -> Table:
    """A row for each common point: labels, mean returns, half-width of their difference's 95 %
    interval, and failures."""
    a, dims = both.a, both.a.dims[:-1]
    grid = np.meshgrid(*(a.coordinates[dim] for dim in dims), indexing="ij")
    columns = {dim: values.ravel().tolist() for dim, values in zip(dims, grid, strict=True)}
    for name in (one for one in a.coordinates if one not in a.dims):
        columns[name] = a.coordinates[name][np.asarray(columns[SAMPLE], int)].tolist()
    for label, found in (("A", both.a), ("B", both.b)):
        columns[f"return {label}"] = found["reward"].mean(axis=-1, dtype=float).ravel().tolist()
        columns[f"failures {label}"] = found["fell"].mean(axis=-1).ravel().tolist()
    halves = [
        half_width(both.a["reward"][t], both.b["reward"][t], _random(both, t))
        for t in range(len(a.coordinates["task"]))
    ]
    columns["half-width"] = np.stack(halves).ravel().tolist()
    heads = [Column(name, a.units.get(name, "-")) for name in columns]
    return Table(heads, list(zip(*columns.values(), strict=True)))


def _random(both: Common, task: int) -> tuple[bool, bool]:
    return is_random(both.a, task), is_random(both.b, task)


def _shared(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the common labels, in each."""
    if a.dtype.kind in "US":
        same = a[:, None] == b[None, :]
    else:
        most = max(np.abs(a).max(), np.abs(b).max(), 1e-300)
        same = np.abs(a[:, None] - b[None, :]) <= CLOSE * most
    first, second = np.nonzero(same)
    return first, second


def _picked(found: SweepArrays, places: tuple[np.ndarray, ...]) -> SweepArrays:
    """The sweep at places of every dimension but the episodes."""
    arrays = {name: one[np.ix_(*places)] for name, one in found.arrays.items()}
    own = dict(zip(found.dims, places, strict=False))
    labels = {n: one[own[n]] if n in own else one for n, one in found.coordinates.items()}
    return replace(found, coordinates=labels, arrays=arrays)


def _listed(labels: np.ndarray) -> str:
    shown = ", ".join(f"{one:g}" if labels.dtype.kind == "f" else str(one) for one in labels[:4])
    return shown + (", ..." if len(labels) > 4 else "")
