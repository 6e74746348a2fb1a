"""The UGV's parameters from options of a reset and from JSON values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import jax

from stickslip.dynamics.checks import require_known
from stickslip.dynamics.numeric import require_one
from stickslip.dynamics.pytrees import rebuilt
from stickslip.dynamics.ugv import Track
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation, ground_of
from stickslip.optim.posture.waypoints import waypoints_along

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.envs.functional import Entries, Given
    from stickslip.envs.ugv.params import UGVEnvParams

OPTIONS = ("track", "friction", "start_angles")
ROUNDING = 1e-6
"""Waypoints may lie so much further apart, relatively: the spacing is one that came out of others,
rounded, and a track as long as the one before gets as many."""


def episode_params(params: UGVEnvParams, options: Mapping[str, Any]) -> UGVEnvParams:
    """The parameters changed by the options; what they set is not drawn."""
    require_known(options, OPTIONS, "option of reset")
    drawn, changes = params.randomisation, {}
    if "friction" in options:
        accepted = "a finite coefficient >= 0"
        changes["friction"] = require_one("friction", options["friction"], low=0, accepted=accepted)
        drawn = replace(drawn, friction=None)
    if "start_angles" in options:
        changes["start_angles"] = options["start_angles"]
        drawn = replace(drawn, start_angles=None)
    if "track" in options:
        track, drawn = ground_of(options["track"], replace(drawn, track=None))
        spacing = float(params.spacing) * (1 + ROUNDING)
        places = waypoints_along(track, params.vehicle, spacing, None, None)
        first, last = float(places[0]), float(places[-1])
        changes |= {"track": track, "start": first, "end": last}
        changes["spacing"] = (last - first) / (len(places) - 1)
    changed = params.replace(randomisation=drawn, **changes)
    if {*options} <= {"start_angles"}:  # nothing that other entries follow from, to the last digit
        own = {name: getattr(changed, name) for name in ("randomisation", "start_angles")}
        return rebuilt(params, **own)
    return changed


def read_by_steps(params: UGVEnvParams) -> UGVEnvParams:
    """The parameters without what only a reset reads. Steps do ask what is drawn, not the range."""
    drawn = jax.tree.map(lambda _: 0.0, replace(params.randomisation, start_angles=None))
    return rebuilt(params, randomisation=drawn, start_angles=0.0)


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
