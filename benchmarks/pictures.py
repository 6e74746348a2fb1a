"""What the pictures of several benchmarks have in common."""

from __future__ import annotations

from typing import Any


def pyplot() -> Any:
    """Matplotlib's, drawing into files without a display."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def logarithmic(axis: Any, x: str, y: str) -> None:
    """Both scales logarithmic, numbers at the powers of ten alone; labels with units."""
    from matplotlib.ticker import NullFormatter

    axis.set_xscale("log")
    axis.set_yscale("log")
    for ticks in (axis.xaxis, axis.yaxis):
        ticks.set_minor_formatter(NullFormatter())
    axis.set_xlabel(x, fontsize=8)
    axis.set_ylabel(y, fontsize=8)
    axis.tick_params(labelsize=8)
    axis.grid(alpha=0.25, linewidth=0.5)
