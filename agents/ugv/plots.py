"""Plots of drives, written as PNG without a display. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.pictures.sheet import make_sheet, name_below, save_sheet
from stickslip.dynamics.status import Status
from stickslip.envs.rendering import theme
from stickslip.envs.ugv.draw import ground

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.optim import Station

LINES = (
    (theme.MUTED, "-"),
    ("#CC79A7", "-."),
    ("#56B4E9", "-"),
    (theme.INK, "--"),
    (theme.SLIDES, "-"),
    ("#E69F00", ":"),
)
"""Colour and style of one controller after the other."""


class Course(NamedTuple):
    """A drive at its waypoints, the first included."""

    at: Station
    """The stations; every leaf [waypoints]."""
    cost: np.ndarray
    """The criterion so far, in its unit."""
    failed: bool


def course(played: Rollout) -> Course:
    """The course of one episode (not a batch)."""
    played = played.trimmed()
    at, cost = jax.tree.map(
        lambda first, rest: np.concatenate([np.asarray(first)[None], rest]),
        *((one.station, one.cost) for one in (played.start_state, played.state)),
    )
    return Course(at, cost, bool(played.info["status"][-1] != Status.OK))


def plot_drive(
    played: Rollout, env: UGVEnv, params: UGVEnvParams, path: str | Path, title: str
) -> Path:
    """One episode over the way: ground, leg angles, torque, grip and cost, as a PNG."""
    at, cost, _ = course(played)
    figure, axes = make_sheet(5, 1, (9, 9), title)
    _draw_ground(axes[0], played, params)
    angles = np.degrees(at.leg_angles)
    axes[1].plot(at.x, angles[:, 0], color=theme.HOLDS, label="rear")
    axes[1].plot(at.x, angles[:, 1], color=theme.INK, ls="--", label="front")
    axes[1].legend(frameon=False, fontsize=9)
    axes[2].plot(at.x, at.torque, color=theme.MOTOR)
    axes[3].plot(at.x, at.grip / 1000, color=theme.SLIDES)
    axes[4].plot(at.x, cost, color=theme.INK)
    titles = (
        "ground [m]",
        "leg angles [°]",
        "torque on each wheel [N m]",
        "margin of grip [kN]",
        _of_cost(env),
    )
    return _save(figure, axes, titles, path)


def plot_comparison(
    played: Mapping[str, Rollout],
    env: UGVEnv,
    params: UGVEnvParams,
    path: str | Path,
    title: str = "Controllers compared",
) -> Path:
    """Several controllers on one ground over the way: leg angles, torque and cost, as a PNG.

    A cross marks the end of a drive that failed. ValueError without a drive.
    """
    if not played:
        raise ValueError("played is empty; accepted: at least one rollout")
    figure, axes = make_sheet(5, 1, (11, 10), title)
    _draw_ground(axes[0], next(iter(played.values())), params)
    for index, (name, one) in enumerate(played.items()):
        colour, style = LINES[index % len(LINES)]
        at, cost, failed = course(one)
        angles = np.degrees(at.leg_angles)
        rows = (angles[:, 0], angles[:, 1], at.torque, cost)
        for axis, values in zip(axes[1:], rows, strict=True):
            axis.plot(at.x, values, label=name, color=colour, ls=style, lw=1.5)
            if failed:
                axis.plot(at.x[-1], values[-1], "x", color=colour, ms=7)
    names = axes[1].get_legend_handles_labels()
    figure.legend(*names, loc="upper right", ncols=len(LINES), frameon=False, fontsize=9.5)
    titles = (
        "ground [m]",
        "rear leg's angle, 90 straight down, more spread outwards [°]",
        "front leg's angle [°]",
        "torque on each wheel, driving forwards is negative [N m]",
        _of_cost(env),
    )
    return _save(figure, axes, titles, path)


def _of_cost(env: UGVEnv) -> str:
    return f"{env.measure.name.replace('_', ' ')} [{env.measure.unit}]"


def _draw_ground(axis: Axes, played: Rollout, params: UGVEnvParams) -> None:
    track = ground(played.start_state.drawn, params)[0].track
    fine = np.linspace(float(params.track.start), float(params.end), 400)
    axis.plot(fine, track.height(jnp.asarray(fine)), color=theme.INK)


def _save(figure: Figure, axes: Sequence[Axes], titles: tuple[str, ...], path: str | Path) -> Path:
    for axis, words in zip(axes, titles, strict=True):
        axis.set_title(words, loc="left", fontsize=10, color=theme.INK, pad=4)
    name_below(axes[-1], "front wheel [m]")
    return save_sheet(figure, path)
