"""What the commands of `stickslip` do for the UGV, once their flags are read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.agents.biped.evaluate import Evaluation, joined
from stickslip.agents.evaluation.rollout import episode_key, rollout
from stickslip.agents.tasks.places import Named, Place, named_controller, places_of, same_unit
from stickslip.agents.ugv import task as ugv_parts
from stickslip.agents.ugv.evaluate import evaluate_ugv, first_state
from stickslip.agents.ugv.tracks import VIEWED
from stickslip.agents.view_files import require_writable, show_window, view_files

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

KIND: Any = ugv_parts


def evaluation(
    given: Mapping[str, Any],
    named: Mapping[str, Named],
    places: list[Place],
    progress: Callable[[str], None],
) -> Evaluation:
    """The table of `stickslip evaluate`."""
    same_unit(places, lambda env: env.measure.unit + " of " + env.criterion)
    parts = []
    for place in places:
        for env in dict.fromkeys(place.who.values()):
            controllers = {
                name: named_controller(named[name], name, env, KIND)
                for name, own in place.who.items()
                if own == env
            }
            tracks = {place.label: place.params}
            episodes = given["episodes"]
            parts.append(
                evaluate_ugv(env, controllers, tracks, episodes=episodes, progress=progress)
            )
    return joined(parts)


def view(given: Mapping[str, Any], named: Mapping[str, Named]) -> None:
    """`stickslip view`: write an animation (and a plot), or show a window."""
    from stickslip.agents.ugv.products import FPS, plot_drive, write_drive

    ((name, one),) = named.items()
    if one.policy is None and not given["scenes"]:
        given = {**given, "scenes": [VIEWED]}
    (place,) = places_of(named, given, KIND, "")
    files = view_files(given, place.label)
    require_writable(files.written)
    print(place.line())
    env, params = place.who[name], place.params
    controller = named_controller(one, name, env, KIND)
    if hasattr(controller, "path"):
        controller = controller.path(env, params, first_state(env, params, given["seed"]))
    played = rollout(env, controller, params, episode_key(given["seed"]))
    for path in files.plots:
        print(f"Written: {plot_drive(played, env, params, path, files.title)}")
    if given["window"]:
        rate = min(FPS, 1 / float(params.control_period))
        show_window(env, played, params, files.title, rate)
    else:
        print(f"Written: {write_drive(env, played, params, files.film, given['seconds'])}")
