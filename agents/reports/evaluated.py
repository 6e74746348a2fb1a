"""An evaluation as a page: the table, and one episode of each controller to play."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from stickslip.agents.evaluation.rollout import horizon, planned, rollout, without_resets
from stickslip.agents.registry import machine_of_env
from stickslip.agents.reports.course import scale_of
from stickslip.agents.reports.writing import REPORT, require_page, write_page
from stickslip.agents.shown_names import shown_name
from stickslip.envs.rendering.html.data import MOST_SAMPLES, Page

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.machine import Options
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed
    from stickslip.envs.rendering.html.data import Shown
    from stickslip.envs.tasks.scale import Scale

    Playing: TypeAlias = tuple[str, str, AnyEnv, AnyPlayer, Timed]
    """Scene, name, environment, player and parameters."""

MOST_EPISODES = 6
"""To play on the page of an evaluation."""


def report_of(given: Options) -> Path | None:
    """Where `stickslip evaluate` writes its page: what --html says, or in --out; None for nowhere.
    ValueError for another kind of file."""
    if given["html"] is None:
        return None if given["out"] is None else Path(given["out"]) / REPORT
    path = Path(given["html"])
    require_page(path)
    return path


def write_evaluation(
    table: Evaluation,
    tasks: Mapping[str, str],
    players: Sequence[Playing],
    path: Path,
    overwrite: bool,
    task: str | None,
    say: Callable[[str], None],
) -> Path:
    """Write the page of `stickslip evaluate`; tasks: what each scene is. Returns the path."""
    episodes = first_episodes(players, table.seeds[0], scale_of(task), say)
    names = ", ".join(dict.fromkeys(shown_name(row.controller) for row in table.rows))
    title = f"{names} on {', '.join(tasks)}"
    notes = left_out(players)
    page = evaluation_page(table, title, "\n".join(tasks.values()), episodes, notes)
    return write_page(page, path, overwrite=overwrite)


def evaluation_page(
    table: Evaluation,
    title: str,
    lead: str,
    episodes: Sequence[Shown] = (),
    notes: Sequence[str] = (),
) -> Page:
    """The page of a table, with the note on its intervals and others."""
    note = (
        "Each number with half its 95 % interval where there is one; see evaluation.json for all."
    )
    rows = (("", table.shown()),)
    return Page(title, lead, tables=rows, episodes=tuple(episodes), notes=(note, *notes))


def left_out(players: Sequence[Playing]) -> list[str]:
    """Whose episodes a page has no room for, in words; nothing where it has all."""
    long = [name for _, name, _, _, params in players if horizon(params) >= MOST_SAMPLES]
    notes = []
    if long:
        names = ", ".join(dict.fromkeys(map(shown_name, long)))
        notes.append(f"Not to play: {names}; more than {MOST_SAMPLES - 1:,} steps an episode.")
    if len(players) - len(long) > MOST_EPISODES:
        notes.append(f"To play: the first {MOST_EPISODES} of {len(players) - len(long)}.")
    return notes


def first_episodes(
    players: Iterable[Playing],
    seed: int,
    scale: Scale | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> tuple[Shown, ...]:
    """The episode of a seed of the first few: scene, name, environment, player and parameters.

    Longer ones than a page holds are left out.
    """
    found = []
    every = [one for one in players if horizon(one[-1]) < MOST_SAMPLES][:MOST_EPISODES]
    scenes = {one[0] for one in every}
    for scene, name, env, player, params in every:
        say(f"{name} on {scene}, to be shown")
        env = without_resets(env)
        played = rollout(env, planned(env, player, params, seed), params, seed)
        whose = shown_name(name) if len(scenes) == 1 else f"{shown_name(name)} on {scene}"
        found.append(machine_of_env(env).shown(played, env, params, whose, scale))
    return tuple(found)
