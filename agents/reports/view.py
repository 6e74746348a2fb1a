"""`stickslip view ... --html FILE`: policies and baselines on one page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.evaluation.rollout import planned, rollout
from stickslip.agents.reports.course import scale_of
from stickslip.agents.reports.writing import require_page, write_page
from stickslip.agents.tasks.named import common_task, title_of
from stickslip.agents.tasks.places import controller_of, machine_of, places_of, read_named
from stickslip.agents.view_files import require_new, require_writable
from stickslip.dynamics.checks import require_integer
from stickslip.envs.rendering.html.data import Page
from stickslip.optim.progress import say_stage

if TYPE_CHECKING:
    from stickslip.agents.machine import Options
    from stickslip.envs.rendering.html.data import Shown

MOST_PLAYERS = 8
"""Side by side on a page."""


def view_page_command(given: Options) -> Path:
    """Write the page, and return its path. given["who"]: names; see `view_command`."""
    path, who = Path(given["html"]), list(given["who"])
    _require_alone(given)
    require_page(path)
    require_new([path], given["overwrite"])
    if len(who) > MOST_PLAYERS:
        raise ValueError(f"{len(who)} to show; accepted: at most {MOST_PLAYERS} on a page")
    require_writable([path])
    episodes, lead, titles = _played(given)
    if len(episodes) > MOST_PLAYERS:
        raise ValueError(f"{len(episodes)} to show; accepted: at most {MOST_PLAYERS} on a page")
    names = ", ".join(dict.fromkeys(one.name for one in episodes))
    title = f"{names} on {titles[0]}" if len(titles) == 1 else names
    page = Page(title, "\n".join(lead), episodes=tuple(episodes))
    print(f"Written: {write_page(page, path, overwrite=given['overwrite'])}")
    return path


def _require_alone(given: Options) -> None:
    others = [f"--{name}" for name in ("out", "plot", "window") if given[name]]
    if others:
        raise ValueError(f"--html with {', '.join(others)}; accepted: one or the other")
    if not 0.02 <= given["seconds"] <= 3600:  # false for NaN, too
        raise ValueError(f"seconds = {given['seconds']}; accepted: 0.02 to 3600")
    require_integer("seed", given["seed"], low=0, high=2**32 - 1)


def _played(given: Options) -> tuple[list[Shown], list[str], list[str]]:
    """An episode of each player on each place, what the places are, and their names."""
    who = given["who"]
    machine = machine_of(who)
    named = read_named(who, machine)
    usual = machine.usual_scene(viewed=True)
    if all(one.policy is None for one in named.values()) and usual != machine.usual_scene():
        given = {**given, "scenes": given["scenes"] or [usual]}
    places = places_of(named, given, machine, viewed=True)
    task = common_task(given)
    scale = scale_of(task)
    shown, seed = [], given["seed"]
    where = [name for place in places for name in place.who]
    for place in places:
        params = machine.params_to_view(place.params, given["seconds"])
        for name, env in place.who.items():
            say_stage(f"playing {name}")
            controller = controller_of(named[name], name, env, params, machine)
            played = rollout(env, planned(env, controller, params, seed), params, seed)
            whose = Path(name).name
            title = whose if where.count(name) == 1 else f"{whose} on {place.label}"
            one = machine.shown(played, env, params, title, scale)
            if len(places) > 1:
                one = replace(one, facts=(("on", place.label), *one.facts))
            shown.append(one)
    lead = [place.line() for place in places] if task is None else [title_of(task)]
    return shown, lead, [task] if task else [place.label for place in places]
