"""`stickslip reproduce`: compute figures, write their pictures, data and the table of claims."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax

from stickslip.dynamics.checks import require_integer
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.sheet import png
from stickslip.optim.progress import Bar
from stickslip.paper.figure import Claim, figures_of
from stickslip.records.files import require_makeable, write_whole
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from typing import TextIO

TABLE = "table.md"
HEAD = ("figure", "the chapter states", "measured here", "verdict", "why")

Claims = Mapping[str, Sequence[Claim]]
"""Claims by figure."""


def reproduce_command(given: Mapping[str, Any]) -> Content:
    """The command with its flags read: figures, out, samples, overwrite; return the claims."""
    names, out = given["figures"], Path(given["out"])
    claims = reproduce(
        names, out, samples=given["samples"], overwrite=given["overwrite"], to=sys.stderr
    )
    print(claims_in_words(claims), end="")
    return Content({"claims": claims_table(claims)}, {"files": list(map(str, files(out, names)))})


def reproduce(
    names: Iterable[str],
    out: str | Path,
    *,
    samples: int = 240,
    overwrite: bool = False,
    to: TextIO | None = None,
) -> Claims:
    """Write DIR/NAME.png, DIR/NAME.csv, more CSV files and DIR/table.md; return the claims.

    names: of FIGURES, or "all". samples: points a step, from 24 to 2400. to: where progress is
    shown, None for nowhere. Computes in float64. Raises ValueError for unknown names and, unless
    overwrite, for files that exist, before anything is computed.
    """
    figures, out = figures_of(names), Path(out)
    accepted = "24 to 2400 points a step"
    require_integer("samples", samples, low=24, high=2400, accepted=accepted)
    if not overwrite and (there := files(out, figures)):
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise ValueError(
            f"{there[0]}{more} exists; accepted: another --out, or --overwrite to replace"
        )
    require("matplotlib.figure")
    require_makeable(out)
    claims: dict[str, Sequence[Claim]] = {}
    bar = Bar("figures", len(figures), "figure", to is not None, to=to, lines=False)
    with jax.enable_x64(True), bar:
        for name, figure in figures.items():
            bar.note(f"{name}: {figure.title}")
            result = figure.compute(samples)
            picture = png(result.draw(), figure.title)
            write_whole(out / f"{name}.png", picture, overwrite=overwrite)
            for ending, columns in result.tables.items():
                text = Table.of_columns(columns).csv(digits=10)
                write_whole(out / f"{name}{ending}.csv", text, overwrite=overwrite)
            claims[name] = result.claims
            bar.advance()
            if to is not None:
                bar.say(f"[{len(claims)}/{len(figures)}] {name}  {figure.title}")
    write_whole(out / TABLE, claims_table(claims).markdown(), overwrite=overwrite)
    return claims


def files(out: Path, names: Iterable[str]) -> list[Path]:
    """Existing files of these figures, and the table of claims."""
    found = [
        path
        for name in figures_of(names)
        for pattern in (f"{name}.png", f"{name}.csv", f"{name}-*.csv")
        for path in sorted(out.glob(pattern))
    ]
    return found + [path for path in (out / TABLE,) if path.exists()]


def claims_table(claims: Claims) -> Table:
    """A row for each claim."""
    rows = [
        [name, claim.stated, claim.measured, claim.verdict, claim.why]
        for name, of_figure in claims.items()
        for claim in of_figure
    ]
    return Table([Column(title, words=True) for title in HEAD], rows)


def claims_in_words(claims: Claims, width: int = 100) -> str:
    """A paragraph for each claim, lines of at most `width` characters."""
    lines = []
    for name, of_figure in claims.items():
        for claim in of_figure:
            lines.append(f"{name}: {claim.verdict}")
            texts = (claim.stated, claim.measured, claim.why)
            for title, text in zip((HEAD[1], HEAD[2], HEAD[4]), texts, strict=True):
                lines += textwrap.wrap(f"  {title}: {text}", width, subsequent_indent="    ")
            lines.append("")
    return "\n".join(lines)
