"""An episode of any machine as a page shows it: curves without a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.reports.course import facts, from_start, panel, reward_panels
from stickslip.envs.rendering.html.data import Event, Shown

if TYPE_CHECKING:
    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.protocol import AnyEnv, Timed
    from stickslip.envs.tasks.known import Scale


def shown(played: AnyRollout, env: AnyEnv, params: Timed, name: str, scale: Scale | None) -> Shown:
    """Actions, the numbers of the info, and the reward."""
    played = played.trimmed()
    rows = {one: played.action[:, i] for i, one in enumerate(env.action_names)}
    rows |= {
        one: values
        for one, values in played.info.items()
        if np.ndim(values) == 1 and np.asarray(values).dtype.kind == "f"
    }
    panels = [panel(one.replace("_", " "), "-", from_start(values)) for one, values in rows.items()]
    ended = "ended early" if bool(played.terminated[-1]) else ""
    return Shown(
        name=name,
        period=float(params.control_period),
        panels=(*panels, *reward_panels(played, {}, "-", scale)),
        events=(Event(int(played.length), "end", ended),) if ended else (),
        numbers=tuple((one.title, one.lines[0].values, 3) for one in panels[:5]),
        ended=ended,
        facts=facts([("return", float(np.sum(played.reward, dtype=np.float64)), "-")]),
    )
