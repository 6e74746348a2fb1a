"""The figures by name; nothing heavy is imported."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, NamedTuple

from stickslip.dynamics.checks import require_known

if TYPE_CHECKING:
    from stickslip.dynamics.biped import BipedParams
    from stickslip.dynamics.ugv import UGVParams
    from stickslip.paper.result import Result


class Figure(NamedTuple):
    """title: over the picture and in the list. module, function: in this package. own: title for
    another machine than the chapter's, whose numbers differ; empty: the same."""

    title: str
    module: str
    function: str
    own: str = ""

    @property
    def machine(self) -> str:
        """biped or ugv."""
        return "ugv" if self.module == "bump" else "biped"

    def compute(self, params: BipedParams | UGVParams, samples: int) -> Result:
        """Compute with so many points a step of the biped, or along the bump of Fig. 24."""
        return resolve_name(f"stickslip.paper.{self.module}:{self.function}")(params, samples)


_TEXT = Path(__file__).with_name("figures.json").read_text(encoding="utf-8")
FIGURES = {name: Figure(**one) for name, one in json.loads(_TEXT).items()}
"""Figures in the chapter's order."""
EVERYTHING = "all"


def figures_of(names: Iterable[str]) -> dict[str, Figure]:
    """The figures asked for, each once, in the chapter's order; ValueError for unknown names."""
    wanted = set(names)
    require_known(sorted(wanted), [*FIGURES, EVERYTHING], "figure here")
    return {name: one for name, one in FIGURES.items() if wanted & {name, EVERYTHING}}
