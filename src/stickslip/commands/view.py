"""`stickslip view`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import Outcome
from stickslip.commands.shared import add_overwrite, add_scene, add_who

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = False
EXAMPLES = {
    "stickslip view biped-ice": "a policy of the package, as biped-ice.gif",
    "stickslip view optimal-gait --scene wet --seconds 3 --out gait.png --plot gait-plot.png": (
        "a baseline, and its episode over time"
    ),
    "stickslip view biped-ice crank-speed-pi --html ice.html": "two side by side, in a browser",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add players, task, duration and files."""
    del arguments
    add_who(parser, many=True)
    parser.add_argument(
        "--html",
        metavar="FILE",
        help="a page to play in a browser, with curves; of one or several",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the episode (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=6.0, help="to show (default: %(default)s)")
    parser.add_argument("--out", metavar="FILE", help=".gif, .png (animated), .webp or .mp4")
    parser.add_argument("--plot", metavar="FILE", help="also a .png of the episode over time")
    add_overwrite(parser)
    parser.add_argument("--window", action="store_true", help="show it on the screen instead")
    add_scene(parser, many=False)


def run(given: argparse.Namespace) -> Outcome:
    """Play and draw."""
    if given.html is not None:
        from stickslip.agents.reports.view import view_page_command

        view_page_command(vars(given))
        return Outcome()
    from stickslip.agents.commands import view_command

    view_command(vars(given))
    return Outcome()
