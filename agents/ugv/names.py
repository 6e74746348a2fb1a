"""Policies and baselines of the UGV by the names that the command line knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.dynamics.plain_checks import require_choice

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.envs.ugv.env import UGVEnv

UGV_BASELINES = ("fixed-posture", "level-body", "receding-horizon", "optimum")
ENVIRONMENT = "UGVEnv"


def is_ugv(who: Sequence[str]) -> bool:
    """Whether the first name that is a baseline or a readable policy is one of the UGV."""
    from stickslip.agents.policy.file import policy_path, read_metadata

    for name in who:
        if name in UGV_BASELINES:
            return True
        path = policy_path(name)
        if path.is_file():
            return read_metadata(path).get("environment") == ENVIRONMENT
    return False


def ugv_baseline(name: str, env: UGVEnv) -> Any:
    """A baseline or planner for an environment. ValueError for an unknown name."""
    from stickslip.agents.ugv.controllers import FixedPosture, LevelBody
    from stickslip.agents.ugv.plans import Optimum, RecedingHorizon

    known = {
        "fixed-posture": lambda: FixedPosture(env),
        "level-body": LevelBody,
        "receding-horizon": RecedingHorizon,
        "optimum": Optimum,
    }
    require_choice("baseline", name, UGV_BASELINES)
    return known[name]()
