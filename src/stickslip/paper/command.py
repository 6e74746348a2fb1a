"""`stickslip reproduce`: compute figures, write their pictures, data and the table of claims."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax

from stickslip.agents.view_files import require_makeable
from stickslip.envs.rendering.extras import require
from stickslip.optim.progress import Bar
from stickslip.paper.drawing import png
from stickslip.paper.registry import Figure, figures_of
from stickslip.paper.result import Claim, Setting
from stickslip.paper.text import claims_in_words, claims_table, claims_text, csv_text
from stickslip.records.content import Content
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from typing import TextIO

TABLE = "table.md"


def reproduce_command(given: Mapping[str, Any]) -> Content:
    """The command with its flags read: figures, out, samples, overwrite; return the claims."""
    claims = reproduce(
        given["figures"],
        given["out"],
        samples=given["samples"],
        overwrite=given["overwrite"],
        to=sys.stderr,
    )
    print(claims_in_words(claims), end="")
    files = files_of(Path(given["out"]), figures_of(given["figures"]))
    return Content({"claims": claims_table(claims)}, {"files": list(map(str, files))})


def reproduce(
    names: Iterable[str],
    out: str | Path,
    *,
    samples: int = 240,
    overwrite: bool = False,
    to: TextIO | None = None,
) -> dict[str, tuple[Claim, ...]]:
    """Write DIR/NAME.png, DIR/NAME.csv (and their kin) and DIR/table.md; return the claims.

    names: of FIGURES, or "all". samples: points a step (see Setting). Computes in float64 whatever
    the switch says. to: where progress is shown, None for nowhere. Raises ValueError for unknown
    names and, unless overwrite, for files that exist: before anything is computed.
    """
    figures, out = figures_of(names), Path(out)
    Setting(samples)  # refuses a bad number before anything is computed
    if not overwrite:
        refuse_to_clobber(out, figures)
    require("matplotlib.figure")
    require_makeable(out)
    claims: dict[str, tuple[Claim, ...]] = {}
    begun = time.monotonic()
    bar = Bar("figures", len(figures), "figure", to is not None, to=to, lines=False)
    with jax.enable_x64(True), bar:
        for place, (name, figure) in enumerate(figures.items(), 1):
            began = time.monotonic()
            result = figure.compute(
                Setting(samples, lambda what, of=name: bar.note(f"{of}: {what}"))
            )
            bar.note(f"{name}: drawing")
            picture = png(result.draw(), figure.title)
            write_whole(out / f"{name}.png", picture, overwrite=overwrite)
            for ending, columns in result.tables.items():
                path = out / f"{name}{ending}.csv"
                write_whole(path, csv_text(columns), overwrite=overwrite)
            claims[name] = tuple(result.claims)
            bar.advance()
            if to is not None:
                took = time.monotonic() - began
                bar.say(f"[{place}/{len(figures)}] {name}  {figure.title}  {took:.1f} s")
    write_whole(out / TABLE, claims_text(claims), overwrite=overwrite)
    if to is not None:
        print(f"{len(figures)} figures in {time.monotonic() - begun:.0f} s: {out}", file=to)
    return claims


def files_of(out: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Every file that reproducing these figures writes."""
    files = [out / TABLE]
    for name, figure in figures.items():
        files += [out / f"{name}.png", *(out / f"{name}{end}.csv" for end in figure.endings)]
    return files


def refuse_to_clobber(out: Path, figures: Mapping[str, Figure]) -> None:
    """Raise ValueError if a file that would be written is there."""
    there = [path for path in files_of(out, figures) if path.exists()]
    if there:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise ValueError(
            f"{there[0]}{more} exists; accepted: another --out, or --overwrite to replace"
        )
