"""Colours, sizes and formats of numbers shared by every part of a picture.

Accents are from Okabe and Ito's set, which stays apart under every kind of colour blindness, and
none of them is the only carrier of its meaning. Sizes are in pixels.
"""

from __future__ import annotations

from math import floor, log10

PAGE = "#FFFFFF"
PANEL = "#F3F5F7"
INK = "#1E2A36"
MUTED = "#5D6B79"
RULE = "#D5DBE1"

SUPPORT = {"main": "#26384A", "mid": "#4C6279", "slim": "#7A8FA5"}
SWING = {"main": "#A9B7C4", "mid": "#BAC6D0", "slim": "#C9D2DA"}
HIP = "#E6DFEC"
HIP_EDGE = "#7B6A8D"
MOTOR = "#0072B2"
HOLDS = "#008069"
SLIDES = "#D55E00"

BAR_WIDTH = {"main": 8.0, "mid": 5.5, "slim": 3.5}
CASING = 1.4

PLAYERS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#B07A00")
"""Colours of players and curves, of Okabe and Ito's set; the last is darker, for white paper."""
DAY: dict[str, str] = {
    "page": PAGE,
    "panel": PANEL,
    "ink": INK,
    "muted": MUTED,
    "rule": RULE,
    "hip": HIP,
    "hip-edge": HIP_EDGE,
    "motor": MOTOR,
    "holds": HOLDS,
    "slides": SLIDES,
    **SUPPORT,
    **{f"pale-{role}": colour for role, colour in SWING.items()},
    "tyre": SUPPORT["main"],
    "rim": SWING["slim"],
    **{f"player-{i}": colour for i, colour in enumerate(PLAYERS)},
}
"""Colours by role, of pictures and of pages by day; night.css has those by night."""

WIDTH, HEIGHT = 960, 540
"""Size of a picture [px]."""
MARGIN = 16.0
HEADER = 40.0
FOOTER = 24.0
GAP = 14.0

SMALL = 10.5
LABEL = 11.5
VALUE = 15.0

SLIPPERY = 0.15
"""A floor below this static friction is drawn as ice [-]."""


def floor_colour(mu_static: float | None) -> str:
    """From pale blue (no friction) over light to dark stone (1 and more); None is a grip floor."""
    share, light, dark = 0.0, (0.83, 0.80, 0.74), (0.47, 0.43, 0.36)
    if mu_static is None:
        light = (0.50, 0.53, 0.56)
    elif mu_static < SLIPPERY:
        light = (0.76, 0.90, 0.97)
    else:
        share = min((mu_static - SLIPPERY) / (1 - SLIPPERY), 1.0)
    mixed = (a + share * (b - a) for a, b in zip(light, dark, strict=True))
    return "#" + "".join(f"{round(255 * part):02x}" for part in mixed)


def written(value: float, digits: int) -> str:
    """Format a number with a true minus sign, and none before a zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def nice_step(rough: float) -> float:
    """The least of 1, 2 and 5 times a power of ten that is not below `rough`."""
    power = 10.0 ** floor(log10(rough))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough * 0.999)
