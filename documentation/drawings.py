"""The site's drawings, from the machines' own kinematics and walks.

    python -m documentation.drawings

Writes docs/machines/biped.svg, leg.svg, ugv.svg and docs/machines/stick_slip.svg.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from documentation import drawing_biped, drawing_slip, drawing_ugv
from documentation.names import ROOT

if TYPE_CHECKING:
    pass

FOLDER = ROOT / "docs" / "machines"
DRAWINGS: dict[str, tuple[Callable[[Figure], None], tuple[float, float]]] = {
    "biped": (drawing_biped.machine, (7.2, 6.2)),
    "leg": (drawing_biped.leg, (7.2, 7.6)),
    "ugv": (drawing_ugv.vehicle, (7.6, 5.0)),
    "stick_slip": (drawing_slip.walk, (8.4, 7.2)),
}
"""What draws each on a figure of a size [inches]."""


def draw(name: str, folder: Path) -> Path:
    """Write one of DRAWINGS as SVG: letters as shapes, the same bytes each time."""
    content, size = DRAWINGS[name]
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    FigureCanvasSVG(figure)
    content(figure)
    path = folder / f"{name}.svg"
    with mpl.rc_context({"svg.hashsalt": name, "svg.fonttype": "path"}):
        figure.savefig(path, metadata={"Date": None}, bbox_inches="tight", pad_inches=0.06)
    return path


def main() -> None:
    """Write all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=FOLDER)
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for name in DRAWINGS:
        path = draw(name, out)
        print(f"Written: {path}, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
