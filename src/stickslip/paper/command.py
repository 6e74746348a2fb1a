"""`stickslip reproduce`: compute figures, write their pictures, data and the table of claims."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import jax

from stickslip.dynamics.checks import require_integer
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.sheet import png
from stickslip.optim.progress import say_stage
from stickslip.paper.figure import figures_of
from stickslip.records.files import require_makeable, require_new, write_whole
from stickslip.records.table import Column, Content, Table

TABLE = "table.md"
HEAD = ("figure", "the chapter states", "measured here", "why")


def reproduce_command(given: Mapping[str, Any]) -> Content:
    """Write DIR/NAME.png, DIR/NAME.csv and DIR/table.md; return the claims.

    Computes in float64. ValueError for unknown names and, unless --overwrite, for files that exist,
    before anything is computed.
    """
    figures, out, overwrite = figures_of(given["figures"]), Path(given["out"]), given["overwrite"]
    accepted = "24 to 2400 points a step"
    require_integer("samples", given["samples"], low=24, high=2400, accepted=accepted)
    require_new(files(out, figures), overwrite)
    require("matplotlib.figure")
    require_makeable(out)
    rows: list[list[str]] = []
    with jax.enable_x64(True):
        for number, (name, figure) in enumerate(figures.items(), 1):
            say_stage(f"[{number}/{len(figures)}] {name}: {figure.title}")
            result = figure.compute(given["samples"])
            picture, text = png(result.draw(), figure.title), result.table().csv(digits=10)
            write_whole(out / f"{name}.png", picture, overwrite=overwrite)
            write_whole(out / f"{name}.csv", text, overwrite=overwrite)
            rows += [[name, *claim] for claim in result.claims]
    table = Table([Column(title, words=True) for title in HEAD], rows)
    write_whole(out / TABLE, table.markdown(), overwrite=overwrite)
    for name, stated, measured, _ in rows:
        print(f"{name}: {stated}: {measured}")
    return Content({"claims": table}, {"files": list(map(str, files(out, figures)))})


def files(out: Path, names: Iterable[str]) -> list[Path]:
    """Existing files of these figures, and the table of claims."""
    found = [out / f"{name}{ending}" for name in names for ending in (".png", ".csv")]
    return [path for path in [*found, out / TABLE] if path.exists()]
