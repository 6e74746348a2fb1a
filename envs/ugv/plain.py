"""The UGV's parameters from plain values, as JSON holds them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.dynamics.ugv import Track
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation

if TYPE_CHECKING:
    from stickslip.envs.plain import Entries, Given


def from_plain(parameters: Entries) -> Given:
    """Arguments of `UGVEnv.make_params` from plain values.

    track: a name, or {name: {...}} with the named track's arguments. randomisation: ranges as
    pairs, by the names of UGVRandomisation; its track by the names of RandomTrack. Numbers stay as
    they are.
    """
    given = dict(parameters)
    track = given.get("track")
    if isinstance(track, dict):
        ((name, numbers),) = track.items()
        given["track"] = Track.named(name, **numbers)
    if "randomisation" in given:
        drawn = _ranges(given["randomisation"])
        if "track" in drawn:
            drawn["track"] = RandomTrack(**_ranges(drawn["track"]))
        given["randomisation"] = UGVRandomisation(**drawn)
    return given


def _ranges(given: Entries) -> Given:
    """Pairs as ranges; what is no pair as it is."""
    return {name: tuple(one) if isinstance(one, list) else one for name, one in given.items()}
