"""Episodes to play in a notebook, or in a page of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

from stickslip.agents.evaluation.rollout import (
    horizon,
    planned,
    require_places,
    rollout,
    validated,
    without_resets,
)
from stickslip.agents.registry import machine_of_env
from stickslip.agents.reports.course import scale_of
from stickslip.agents.reports.writing import write_page
from stickslip.dynamics.checks import require_integer
from stickslip.envs.rendering.html.data import MOST_SAMPLES, Page
from stickslip.envs.rendering.html.document import page_text

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Params, Player, State, Timed
    from stickslip.envs.functional import FunctionalEnv
    from stickslip.envs.rendering.html.data import Shown
    from stickslip.envs.tasks.known import Scale

TALL = 860
"""Height of a page in a notebook [px]."""
MOST_EPISODES = 6
"""On the page of `show`."""


@dataclass(frozen=True)
class View:
    """A page: a notebook shows it in place, `save` writes it to a file."""

    page: Page

    def __repr__(self) -> str:
        """In a line: a notebook keeps it beside the page itself."""
        return f"View({self.page.title!r}, episodes={len(self.page.episodes)})"

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page as one .html file and return its path. ValueError for another kind of
        file, and for one that exists unless overwrite."""
        return write_page(self.page, path, overwrite=overwrite)

    def _repr_html_(self) -> str:
        """The page in a frame of its own, which can neither reach the notebook nor a network."""
        text = escape(page_text(self.page))
        return (
            f'<iframe srcdoc="{text}" sandbox="allow-scripts" title="{escape(self.page.title)}" '
            f'style="width:100%;height:{TALL}px;border:0"></iframe>'
        )


def show(
    env: FunctionalEnv[State, Params],
    players: Player[State, Params] | Mapping[str, Player[State, Params]],
    params: Params,
    seed: int = 0,
    *,
    task: str | None = None,
) -> View:
    """Play a seed's first episode of one player, or of several by name, to be looked at.

    players: controllers, policies or the UGV's planners, six at most. task: a named one, for its
    scores. ValueError without a player, and for an environment of no machine.
    """
    require_integer("seed", seed, low=0, high=2**32 - 1)
    named: Mapping[str, Player[State, Params]]
    named = players if isinstance(players, Mapping) else {type(players).__name__: players}
    if not named:
        raise ValueError("players is empty; accepted: at least one")
    where = type(env).__name__ if task is None else task
    require_places(env, {"params": params})
    named = {name: validated(f"players[{name!r}]", one) for name, one in named.items()}
    every = [(where, name, env, one, params) for name, one in named.items()]
    shown = first_episodes(every, seed, scale_of(task))
    return View(Page(f"{', '.join(named)} on {where}", episodes=shown))


def first_episodes(
    players: Iterable[tuple[str, str, AnyEnv, AnyPlayer, Timed]],
    seed: int,
    scale: Scale | None = None,
) -> tuple[Shown, ...]:
    """The episode of a seed of the first few: scene, name, environment, player and parameters.

    Longer ones than a page holds are left out.
    """
    found = []
    every = [one for one in players if horizon(one[-1]) < MOST_SAMPLES][:MOST_EPISODES]
    scenes = {one[0] for one in every}
    for scene, name, env, player, params in every:
        env = without_resets(env)
        played = rollout(env, planned(env, player, params, seed), params, seed)
        whose = name if len(scenes) == 1 else f"{name} on {scene}"
        found.append(machine_of_env(env).shown(played, env, params, whose, scale))
    return tuple(found)
