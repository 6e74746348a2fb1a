"""Output of a simulation: summary, rows, plot and film. Pictures need the extra `viz`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np

from stickslip.agents.biped.pictures import LEAST_SLID, Course
from stickslip.agents.pictures.film import write_pictures
from stickslip.agents.pictures.plots import plot_panels
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.animation import require_format
from stickslip.envs.rendering.biped import BipedFrame, BipedRenderer
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.ugv import UGVRenderer
from stickslip.envs.ugv.picture import station_frames
from stickslip.optim.posture.problem import refined
from stickslip.optim.progress import say_stage
from stickslip.records.files import (
    require_new,
    require_suffix,
    require_writable,
    write_whole,
    writing,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.envs.rendering.ugv import UGVFrame
    from stickslip.optim import PostureProblem
    from stickslip.records.table import Table
    from stickslip.simulate.flags import Output
    from stickslip.simulate.walk import Walk

TABLES = (".csv", ".parquet")


LONGEST_FILM = 600.0
"""Seconds of motion."""


class Files(NamedTuple):
    """Paths of the rows, the plot and the film; None for none."""

    table: Path
    plot: Path | None
    film: Path | None
    overwrite: bool

    @classmethod
    def of(cls, given: Output, seconds: float) -> Files:
        """The paths that are asked for; seconds: of the film.

        ValueError for another kind, a folder, a file that is not to be replaced, a film that is too
        long. The packages that write them are imported now, not when everything is computed.
        """
        table = Path(given.out)
        plot, film = (None if one is None else Path(one) for one in (given.plot, given.film))
        require_suffix(table, TABLES)
        if table.is_dir():
            raise ValueError(f"{table} is a directory; accepted: the path of a file")
        if table.suffix.lower() == ".parquet":
            import pyarrow.parquet  # noqa: F401
        if plot is not None:
            require_suffix(plot, (".png",))
            require("matplotlib.figure")
        if film is not None:
            require_format(film)
            if seconds > LONGEST_FILM:
                raise ValueError(f"--film of {seconds:g} s; accepted: up to {LONGEST_FILM:g} s")
            if film == plot:
                raise ValueError(f"--film {film} with --plot {plot}; accepted: two files")
        written = [one for one in (table, plot, film) if one is not None]
        require_new(written, given.overwrite)
        require_writable(written)
        return cls(table, plot, film, given.overwrite)

    def write(
        self, table: Table, plot: Callable[[Path], object], film: Callable[[Path], object]
    ) -> list[str]:
        """Write the files that are asked for, say which, and return their names."""
        write_table(self.table, table, self.overwrite)
        for path, draw in ((self.plot, plot), (self.film, film)):
            if path is not None:
                draw(path)
        written = [str(one) for one in self[:3] if one is not None]
        print(f"Written: {', '.join(written)}")
        return written


def write_table(path: Path, table: Table, overwrite: bool) -> None:
    """Write it whole; no digit is lost.

    CSV: units in the head, numbers as Python shows them, None and NaN empty. Parquet: units in the
    columns' metadata, None as null.
    """
    if path.suffix.lower() == ".csv":
        write_whole(path, table.csv(), overwrite=overwrite)
        return
    import pyarrow as pa
    from pyarrow import parquet

    columns = zip(*table.rows, strict=True) if table.rows else [()] * len(table.columns)
    arrays = [pa.array(list(values)) for values in columns]
    fields = [
        pa.field(column.name, array.type, metadata={"unit": column.unit})
        for column, array in zip(table.columns, arrays, strict=True)
    ]
    with writing(path, overwrite=overwrite) as file:
        parquet.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), file)


def print_summary(summary: Table, promise: str | None = None) -> None:
    """Print a line a number, with its unit; None is left out."""
    width = max(len(column.name) for column in summary.columns)
    for column, value in zip(summary.columns, summary.rows[0], strict=True):
        if value is not None:
            unit = "" if column.unit == "-" else f" {column.unit}"
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
            print(f"{column.name.replace('_', ' '):<{width}}  {text}{unit}")
    if promise is not None:
        print(f"{'promise':<{width}}  {promise}")


FPS = 25.0
"""Pictures a second."""
SPEED = 1.0
"""At which a drive is shown [m/s]; its statics know no time."""


def plot_walk(walk: Walk, path: Path, title: str) -> Path:
    """Plot torque, crank rate, P w, friction used and distance slid; return the path."""
    states = jax.tree.map(lambda leaf: leaf[1:], walk.trajectory.states)
    contacts, time = walk.trajectory.contacts, np.asarray(states.time)
    course = Course(
        torque=np.asarray(walk.trajectory.torques),
        rate=np.asarray(states.crank_rate),
        momentum=walk.along.momentum[1:],
        friction=np.asarray(contacts.friction_force),
        normal=np.asarray(contacts.normal_force),
        mu_static=walk.along.mu_static[1:],
        slide=np.asarray(states.foot_position),
        slid=np.cumsum(contacts.slide_distance, dtype=np.float64),
    )
    slips = np.asarray(contacts.slide_distance) > LEAST_SLID
    return plot_panels(course.panels(), time, "time [s]", path, title, slips)


def film_walk(walk: Walk, path: Path) -> Path:
    """Write a film of the walk in real time; return the path."""
    states, contacts = walk.trajectory.states, walk.trajectory.contacts
    time = np.asarray(states.time - states.time[0])
    turned = np.asarray(states.crank_angle) - np.asarray(states.crank_angle)[0]

    def frame(i: int) -> BipedFrame:
        ended = i == walk.count and walk.status.terminal
        row = max(i - 1, 0)  # at the start there are no forces yet
        names = ("friction_force", "normal_force", "zmp")
        forces: dict[str, Any] = {
            one: float(getattr(contacts, one)[row]) * (i > 0) for one in names
        }
        return BipedFrame(
            phase=states.phase[i],
            steps=states.steps[i],
            floor_position=walk.along.ankle[i],
            slide=states.foot_position[i],
            crank_rate=states.crank_rate[i],
            time=time[i],
            torque=walk.trajectory.torques[row],
            **forces,
            mu_static=walk.along.mu_static[i],
            mu_kinetic=walk.along.mu_kinetic[i],
            sticking=i == 0 or contacts.mode[row] == 0,
            mean_crank_rate=turned[i] / time[i] if time[i] > 0 else states.crank_rate[0],
            status=walk.status.name if ended else Status.OK.name,
            walked=walk.along.mass[i] - walk.along.mass[0],
        )

    say_stage(f"drawing {path}")
    renderer = BipedRenderer(walk.robot.params, walk.scene)
    return write_pictures(renderer, frame, walk.count, walk.period, path, FPS, progress=True)


def film_drive(problem: PostureProblem, x: np.ndarray, path: Path) -> Path:
    """Write a film of the drive at SPEED, legs turning evenly between waypoints; return the path.

    The header has the largest torque so far.
    """
    length, last = float(problem.x[-1] - problem.x[0]), len(problem.x) - 1
    fine, angles = refined(problem, x, max(1, round(FPS * length / SPEED / last)))
    stations, last = fine.stations(angles), len(fine.x) - 1
    largest = np.maximum.accumulate(np.abs(stations.torque))
    friction = np.broadcast_to(fine.posture.friction, len(fine.x))

    def frame(i: int) -> UGVFrame:
        at = stations.map(lambda of: np.asarray(of)[i : i + 1])
        about = fine.posture.odometer, friction[i : i + 1], fine.posture.params, fine.solver
        with jax.enable_x64(True):
            found = station_frames(at, largest[i : i + 1], *about)
        return replace(found, start=float(fine.x[0]))

    say_stage(f"drawing {path}")
    renderer = UGVRenderer(problem.params, "largest torque", "N m")
    period = length / SPEED / last
    return write_pictures(renderer, frame, last, period, path, FPS, progress=True)
