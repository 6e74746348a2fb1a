"""Names of controllers in plots, tables and texts."""

from __future__ import annotations

WORDS = {
    "constant-torque": "constant torque",
    "crank-speed-pi": "crank-speed PI",
    "computed-torque": "computed torque",
    "optimal-gait": "optimal gait",
    "stop-at-mark": "stop at mark",
    "fixed-posture": "fixed posture",
    "level-body": "level body",
    "receding-horizon": "receding horizon",
}


def shown_name(name: str) -> str:
    """A baseline's name in words; any other name, as policies and files have them, as it is.

    Files and the command line keep the name itself.
    """
    return WORDS.get(name, name)
