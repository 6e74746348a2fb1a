"""The page's colours: those of the pictures by day, others of the same meaning by night."""

from __future__ import annotations

from stickslip.envs.rendering import theme

PLAYERS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#B07A00")
"""Of players and curves, from Okabe and Ito's set; the last one darker, to be read on white."""
DAY = {
    "page": theme.PAGE,
    "panel": theme.PANEL,
    "ink": theme.INK,
    "muted": theme.MUTED,
    "rule": theme.RULE,
    "hip": theme.HIP,
    "hip-edge": theme.HIP_EDGE,
    "motor": theme.MOTOR,
    "holds": theme.HOLDS,
    "slides": theme.SLIDES,
    "shadow": "#5D6B7980",
    "badge": theme.PAGE,
    "badge-holds": theme.HOLDS,
    "badge-slides": "#B85000",
    "badge-ended": theme.INK,
    "ground-alpha": "1",
    **theme.SUPPORT,
    **{f"pale-{role}": colour for role, colour in theme.SWING.items()},
    "tyre": theme.SUPPORT["main"],
    "rim": theme.SWING["slim"],
    **{f"player-{i}": colour for i, colour in enumerate(PLAYERS)},
}
NIGHT = DAY | {
    "page": "#12181F",
    "panel": "#1B242D",
    "ink": "#E6ECF2",
    "muted": "#9CAAB8",
    "rule": "#33404D",
    "hip": "#3B3348",
    "hip-edge": "#B5A3CB",
    "motor": "#3F9BDC",
    "holds": "#12A387",
    "slides": "#F07A28",
    "shadow": "#9CAAB880",
    "badge": "#12181F",
    "badge-holds": "#12A387",
    "badge-slides": "#F07A28",
    "badge-ended": "#9CAAB8",
    "ground-alpha": "0.42",
    "main": "#D3DEE9",
    "mid": "#A9BBCD",
    "slim": "#8196AB",
    "pale-main": "#55636F",
    "pale-mid": "#4C5964",
    "pale-slim": "#414D57",
    "tyre": "#A9BBCD",
    "rim": "#33404D",
    "player-0": "#3F9BDC",
    "player-1": "#F07A28",
    "player-2": "#12B98A",
    "player-5": "#E69F00",
}


def style_of_colours() -> str:
    """Variables of CSS: by day, by night where the system or the reader asks for it."""
    day, night = (
        "".join(f"--{name}:{colour};" for name, colour in one.items()) for one in (DAY, NIGHT)
    )
    return (
        f":root{{color-scheme:light;{day}}}\n"
        "@media (prefers-color-scheme:dark){:root:not([data-theme=light])"
        f"{{color-scheme:dark;{night}}}}}\n"
        f":root[data-theme=dark]{{color-scheme:dark;{night}}}\n"
    )


def hexadecimal(colour: tuple[float, float, float]) -> str:
    """Red, green and blue from 0 to 1 as #rrggbb."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)
