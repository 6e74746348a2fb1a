"""Grounds of the UGV by the names that the command line knows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip import envs
from stickslip.agents.built import Built
from stickslip.dynamics import ugv
from stickslip.dynamics.plain_checks import nearest, shown
from stickslip.dynamics.ugv.names import RANDOM_TRACKS

if TYPE_CHECKING:
    from stickslip.dynamics.ugv import Track
    from stickslip.envs import RandomTrack


@dataclass(frozen=True)
class Ground:
    """A track, and what is drawn in its place for every episode, if anything."""

    track: Track
    drawn: RandomTrack | None = None


FIXED = ("bump", "sinusoid", "ramp", "step", "ditch", "flat", "incline")
RANDOM: Built[RandomTrack] = Built(
    {name: lambda name=name: envs.RandomTrack.named(name) for name in RANDOM_TRACKS}
)
GROUND = "random-bump"
"""The ground where none is named."""
VIEWED = "bump"
"""The ground that a baseline alone is viewed on, where none is named."""
TRACK_NAMES = (*RANDOM, *FIXED)
"""See RandomTrack.named; the others are named tracks with their defaults."""


def ground_by_name(name: str) -> Ground:
    """The ground of that name, or from the file of that name. ValueError listing the names."""
    if name in RANDOM:
        return Ground(ugv.Track.flat(), RANDOM[name])
    if name in FIXED:
        return Ground(ugv.Track.named(name))
    path = Path(name)
    if path.suffix and path.is_file():
        from stickslip.optim.posture.track_file import read_track

        return Ground(read_track(path))
    raise _unknown(name)


def require_ground(name: str) -> None:
    """Raise ValueError for what is neither a known name nor looks like a file's.

    Whether a file is there is asked when it is read: a configuration outlives the files it names.
    """
    if name not in TRACK_NAMES and not Path(name).suffix:
        raise _unknown(name)


def _unknown(name: str) -> ValueError:
    return ValueError(
        f"track {shown(name)} is unknown; accepted: {', '.join(TRACK_NAMES)}, or a file of points"
        f"{nearest(name, TRACK_NAMES)}"
    )
