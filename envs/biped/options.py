"""The biped's parameters from options of a reset and from JSON values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import jax

from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.checks import require_choice, require_known
from stickslip.dynamics.numeric import require_one
from stickslip.dynamics.pytrees import rebuilt
from stickslip.dynamics.scene import PAYLOAD, Scene, scene_of
from stickslip.envs.biped.params import Randomisation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.functional import Entries, Given

SLACK = 1e-6
"""Tolerance of a phase at the end of its range, in single precision [rad]."""
START: dict[str, dict[str, Any]] = {
    "phase": {
        "low": SUPPORT_START - SLACK,
        "high": SUPPORT_END + SLACK,
        "accepted": "an angle within pi/2 to 3 pi/2 [rad]",
    },
    "crank_rate": {"accepted": "a finite rate [rad/s]"},
    "mean_rate": {"low": SLACK, "accepted": "a finite rate > 0 [rad/s]"},
    "mass": {"low": SLACK, "accepted": "a finite factor > 0"},
    "mark": {"low": SLACK, "accepted": "a finite way > 0 [m]"},
}
"""Options that replace a draw, and the rule of each."""
OPTIONS = ("scene", "payload", *START)
START_ALONE = ("phase", "crank_rate", "mean_rate", "command_interval", "mark")
"""Draws that no step reads: commands to come are in the state."""


def episode_params(params: BipedEnvParams, options: Mapping[str, Any]) -> BipedEnvParams:
    """The parameters changed by the options; what they set is not drawn."""
    require_known(options, OPTIONS, "option of reset")
    drawn, scene = params.randomisation, params.scene
    for name, rule in START.items():
        if name in options:
            value = require_one(name, options[name], **rule)
            drawn = replace(drawn, **{name: (value, value)})
    if "scene" in options:
        scene, drawn = scene_of(options["scene"]).validate(), replace(drawn, friction=None)
    if "payload" in options:
        payload = require_one("payload", options["payload"], **PAYLOAD)
        scene, drawn = replace(scene, payload=payload), replace(drawn, payload=None)
    # So that an episode has a start of its own whatever is named: one program for all of them.
    usual = {"phase": SUPPORT_START, "crank_rate": 0.0, "mean_rate": params.mean_rate}
    usual |= {} if params.mark is None else {"mark": params.mark}
    for name, value in usual.items():
        if getattr(drawn, name) is None:
            drawn = replace(drawn, **{name: (value, value)})
    changes = {} if scene is params.scene else {"scene": scene}
    return params.replace(randomisation=drawn, **changes)


def read_by_steps(params: BipedEnvParams) -> BipedEnvParams:
    """The parameters without what only a reset reads. Steps do ask what is drawn, not the range."""
    drawn = replace(params.randomisation, **dict.fromkeys(START_ALONE))
    drawn = jax.tree.map(lambda _: 0.0, drawn)
    mark = None if params.mark is None else 0.0
    return rebuilt(params, randomisation=drawn, mean_rate=0.0, mark=mark)


FLOORS = ("uniform", "patches")
"""Constructors of Scene that take numbers alone."""


def from_plain(parameters: Entries) -> Given:
    """Arguments of `BipedEnv.make_params` from plain values.

    scene: a name, or {"uniform": {...}} or {"patches": {...}} with the constructor's arguments.
    randomisation: ranges as pairs, by the names of Randomisation. Numbers stay as they are.
    """
    given = dict(parameters)
    scene = given.get("scene")
    if isinstance(scene, dict):
        ((kind, numbers),) = scene.items()
        require_choice("scene", kind, FLOORS)
        given["scene"] = getattr(Scene, kind)(**numbers)
    if "randomisation" in given:
        ranges = {name: tuple(ends) for name, ends in given["randomisation"].items()}
        given["randomisation"] = Randomisation(**ranges)
    return given
