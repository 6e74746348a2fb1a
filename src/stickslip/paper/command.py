"""`stickslip reproduce`: compute figures, write their pictures, data and the table of claims."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax

from stickslip.dynamics.checks import require_integer
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.sheet import png
from stickslip.optim.progress import say_stage
from stickslip.paper.figure import figures_of
from stickslip.paper.result import Claim
from stickslip.records.files import require_makeable, require_new, write_whole
from stickslip.records.table import Column, Content, Table

TABLE = "table.md"
HEAD = ("figure", "the chapter states", "measured here", "verdict", "why")

Claims = Mapping[str, Sequence[Claim]]
"""Claims by figure."""


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
    claims: dict[str, Sequence[Claim]] = {}
    with jax.enable_x64(True):
        for number, (name, figure) in enumerate(figures.items(), 1):
            say_stage(f"[{number}/{len(figures)}] {name}: {figure.title}")
            result = figure.compute(given["samples"])
            picture, text = png(result.draw(), figure.title), result.table().csv(digits=10)
            write_whole(out / f"{name}.png", picture, overwrite=overwrite)
            write_whole(out / f"{name}.csv", text, overwrite=overwrite)
            claims[name] = result.claims
    table = claims_table(claims)
    write_whole(out / TABLE, table.markdown(), overwrite=overwrite)
    print(claims_in_words(claims), end="")
    return Content({"claims": table}, {"files": list(map(str, files(out, figures)))})


def files(out: Path, names: Iterable[str]) -> list[Path]:
    """Existing files of these figures, and the table of claims."""
    found = [out / f"{name}{ending}" for name in names for ending in (".png", ".csv")]
    return [path for path in [*found, out / TABLE] if path.exists()]


def claims_table(claims: Claims) -> Table:
    """A row for each claim."""
    rows = [
        [name, claim.stated, claim.measured, claim.verdict, claim.why]
        for name, of_figure in claims.items()
        for claim in of_figure
    ]
    return Table([Column(title, words=True) for title in HEAD], rows)


def claims_in_words(claims: Claims) -> str:
    """A paragraph for each claim."""
    lines = []
    for name, of_figure in claims.items():
        for claim in of_figure:
            lines.append(f"{name}: {claim.verdict}")
            texts = (claim.stated, claim.measured, claim.why)
            for title, text in zip((HEAD[1], HEAD[2], HEAD[4]), texts, strict=True):
                lines += textwrap.wrap(f"  {title}: {text}", 100, subsequent_indent="    ")
            lines.append("")
    return "\n".join(lines)
