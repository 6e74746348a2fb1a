"""Episodes of several players on one page: for a notebook, and `stickslip view`."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from stickslip.agents.evaluation import rollout
from stickslip.agents.evaluation.players import common_task, machine_of, places_of, read_named
from stickslip.agents.machine import Machine, machine_of_env
from stickslip.agents.pictures.episodes import scale_of, write_film
from stickslip.agents.policy.file import policy_path
from stickslip.agents.policy.shipped import shipped_path
from stickslip.agents.protocol import Options, Params, Player, State
from stickslip.dynamics.checks import require_integer, require_that
from stickslip.envs.functional import AnyEnv, FunctionalEnv, Timed
from stickslip.envs.rendering.animation import SUFFIXES, require_format
from stickslip.envs.rendering.page import Page, page_text
from stickslip.envs.tasks.definition import task_by_name
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_suffix, require_writable, write_whole

TALL = 860
"""Height of a page in a notebook [px]."""
PLAYERS: dict[str, Any] = {"high": 8, "accepted": "1 to 8 on a page"}
"""Side by side on a page."""
PAGES = (".html", ".htm")


@dataclass(frozen=True)
class View:
    """A page: a notebook shows it in place, `save` writes it to a file."""

    page: Page = field(repr=False)

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page atomically as one .html file and return its path.

        ValueError for another kind of file, and for one that exists unless overwrite.
        """
        require_suffix(Path(path), PAGES)
        return write_whole(path, page_text(self.page), overwrite=overwrite)

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
    """Play a seed's first episode of one player, or of several by name, as a page.

    players: controllers, policies or the UGV's planners, eight at most. task: a named one, for its
    scores. ValueError without a player, and for an environment of no machine.
    """
    require_integer("seed", seed, low=0, high=2**32 - 1)
    named: Mapping[str, Player[State, Params]]
    named = players if isinstance(players, Mapping) else {type(players).__name__: players}
    require_integer("players", len(named), **PLAYERS)
    rollout.require_places(env, {"params": params})
    named = {name: rollout.validated(f"players[{name!r}]", one) for name, one in named.items()}
    alone, label = rollout.without_resets(env), type(env).__name__
    replays = [_play(name, label, alone, one, params, seed) for name, one in named.items()]
    return View(_page(machine_of_env(env), replays, task))


class Replay(NamedTuple):
    """A player's episode. label: of the place."""

    name: str
    label: str
    env: AnyEnv
    params: Timed
    episode: rollout.Rollout


def _play(name: str, label: str, env: AnyEnv, player: Player, params: Timed, seed: int) -> Replay:
    found = rollout.rollout(env, rollout.planned(env, player, params, seed), params, seed)
    return Replay(name, label, env, params, found)


def view_command(given: Options) -> None:
    """`stickslip view`: write a page, or an animation of one episode."""
    asked = list(given["who"])
    require_integer("seed", given["seed"], low=0, high=2**32 - 1)
    seconds = given["seconds"]
    require_that(0.02 <= seconds <= 3600, "seconds", seconds, "0.02 to 3600")  # false for NaN, too
    require_integer("players", len(asked), **PLAYERS)
    named = read_named(asked)
    machine = machine_of(named)
    if machine.viewed_scene and all(one.policy is None for one in named.values()):
        given = {**given, "scenes": given["scenes"] or [machine.viewed_scene]}
    places, task = places_of(named, given, viewed=True), common_task(named, given)
    count = sum(len(place.who) for place in places)
    require_integer("players", count, **PLAYERS)
    path = Path(given["out"] or _file_name(asked[0], places[0].label, task))
    is_page = path.suffix.lower() in PAGES
    if not is_page:
        require_suffix(path, (*PAGES, *SUFFIXES))
        require_format(path)
        if count > 1:
            raise ValueError(f"{path} of {count} episodes; accepted: several in an .html")
    require_writable([path], given["overwrite"])
    lead = [place.line() for place in places] if task is None else [task_by_name(task).headline]
    replays = []
    for place in places:
        params = machine.params_to_view(place.params, given["seconds"])
        for name, env in place.who.items():
            say_stage(f"playing {name}")
            given_by, player = Path(name).name, named[name].player(env, params)
            replays.append(_play(given_by, place.label, env, player, params, given["seed"]))
    if is_page:
        View(_page(machine, replays, task, lead)).save(path, overwrite=given["overwrite"])
    else:
        one = replays[0]
        say_stage(f"drawing {path}")
        write_film(one.env, one.episode, one.params, path, machine.frames, given["seconds"], True)
    print("\n".join(lead))
    print(f"Written: {path}")


def _file_name(who: str, place: str, task: str | None) -> str:
    """Name of the animation, or of a page without Pillow: player and place, of a shipped policy on
    its own task the policy alone."""
    kind = ".gif" if find_spec("PIL") else ".html"
    if kind == ".html":
        say_stage('films need Pillow (pip install "stickslip[viz]"): writing a page instead')
    path, shipped = policy_path(who), shipped_path(who) is not None
    name = who if shipped else path.parent.name if path.name == "policy.npz" else Path(who).name
    label = Path(place).stem if Path(place).is_file() else place
    where = "" if shipped and task is not None else "-" + re.sub(r"[^\w.+-]+", "-", label)
    return name.removesuffix(".npz") + where + kind


def _page(
    machine: Machine, replays: Sequence[Replay], task: str | None, lead: Sequence[str] = ()
) -> Page:
    """The page of episodes with names of their own; of several places, each is a fact."""
    names, labels = [one.name for one in replays], {one.label for one in replays}
    episodes = []
    for one in replays:
        name = one.name if names.count(one.name) == 1 else f"{one.name} on {one.label}"
        episode = machine.as_episode(one.episode, one.env, one.params, name, scale_of(task))
        if len(labels) > 1:
            episode = replace(episode, facts=(("on", one.label), *episode.facts))
        episodes.append(episode)
    title = ", ".join(dict.fromkeys(names))
    if task is not None or len(labels) == 1:
        title += f" on {task or replays[0].label}"
    return Page(title, "\n".join(lead), tuple(episodes))
