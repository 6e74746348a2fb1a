"""Policies and baselines of the UGV by the names that the command line knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.agents.policy_file import choices_of, load_policy, policy_path, read_metadata

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.envs.ugv import UGVEnv

UGV_BASELINES = ("fixed-posture", "level-body", "receding-horizon", "optimum")
ENVIRONMENT = "UGVEnv"


def is_ugv(who: Sequence[str]) -> bool:
    """Whether the first name that is a baseline or a readable policy is one of the UGV."""
    for name in who:
        if name in UGV_BASELINES:
            return True
        path = policy_path(name)
        if path.is_file():
            return read_metadata(path).get("environment") == ENVIRONMENT
    return False


def ugv_baseline(name: str, env: UGVEnv) -> Any:
    """A baseline or planner for an environment. ValueError for an unknown name."""
    from stickslip.agents.ugv_controllers import FixedPosture, LevelBody
    from stickslip.agents.ugv_plans import Optimum, RecedingHorizon

    known = {
        "fixed-posture": lambda: FixedPosture(env),
        "level-body": LevelBody,
        "receding-horizon": RecedingHorizon,
        "optimum": Optimum,
    }
    if name not in known:
        raise ValueError(f"baseline {name!r} is unknown; accepted: {', '.join(UGV_BASELINES)}")
    return known[name]()


def read_ugv_policies(who: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The policies among the names, and what the first one's file says of its environment.

    The others have to share that where it matters. ValueError for what is neither policy nor
    baseline.
    """
    policies: dict[str, Any] = {}
    first: dict[str, Any] = {}
    for name in who:
        if name in UGV_BASELINES:
            continue
        path = policy_path(name)
        if not path.exists():
            raise ValueError(
                f"{name!r} is neither a baseline of the UGV nor a file; accepted: "
                f"{', '.join(UGV_BASELINES)}, a policy file, or the directory of a run with one"
            )
        policies[name], about = load_policy(path), read_metadata(path)
        if about.get("environment") != ENVIRONMENT:
            raise ValueError(f"{name!r} is no policy of the UGV; accepted: policies of one machine")
        first = first or about
        for seen in ("preview", "criterion"):
            own, others = (choices_of(one).get(seen) for one in (about, first))
            if own != others:
                raise ValueError(
                    f"{name!r} was trained with {seen} = {own!r}, another one with {others!r}; "
                    "accepted: policies of the same, or one at a time"
                )
    return policies, first
