"""Where the commands of `stickslip` write, and what `stickslip view` shows, of any machine."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from contextlib import suppress
from errno import ENOTDIR
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from stickslip.agents.policy.file import policy_path
from stickslip.agents.policy.shipped import shipped_path
from stickslip.envs.rendering.animation import require_format

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.machine import Options
    from stickslip.agents.protocol import AnyEnv, Timed


FILES = (".csv", ".json", ".parquet", ".html", ".htm", ".md", ".txt", ".png", ".gif", ".npz")
"""What no directory of results is called."""


class ViewFiles(NamedTuple):
    """What `stickslip view` is to write."""

    title: str
    """Who is shown where."""
    film: Path
    """The animation, unless a window is asked for."""
    plots: list[Path]
    """One or none."""
    window: bool = False

    @property
    def written(self) -> list[Path]:
        """All files that will be there."""
        return self.plots if self.window else [*self.plots, self.film]


def view_files(given: Options, place: str, task: str | None = None) -> ViewFiles:
    """What the flags ask for; place: the task's label; task: the policy's own, if that is a named
    one and nothing of it is changed.

    ValueError for seconds out of range, files of another kind, and ones that are not to be
    replaced.
    """
    if not 0.02 <= given["seconds"] <= 3600:  # false for NaN, too
        raise ValueError(f"seconds = {given['seconds']}; accepted: 0.02 to 3600")
    shipped, who = shipped_path(given["who"]) is not None, policy_path(given["who"])
    name = who.parent.name if who.name == "policy.npz" else who.name
    name = given["who"] if shipped else name.removesuffix(".npz")
    own = shipped and task is not None  # its name says where
    film = Path(given["out"] or (f"{name}.gif" if own else f"{name}-{_for_a_file(place)}.gif"))
    plots = [] if given["plot"] is None else [Path(given["plot"])]
    require_format(film)
    for path in plots:
        require_suffix(path, (".png",))
    require_new(plots + ([] if given["window"] else [film]), given["overwrite"])
    return ViewFiles(f"{name} on {task or place}", film, plots, given["window"])


def _for_a_file(label: str) -> str:
    return re.sub(r"[^\w.+-]+", "-", Path(label).stem if Path(label).is_file() else label)


def show_window(env: AnyEnv, played: AnyRollout, params: Timed, title: str, fps: float) -> None:
    """Show an episode once, at the speed of life, until its end or until the window is closed."""
    from stickslip.agents.pictures.film import pictures
    from stickslip.envs.rendering import Window

    window = Window(title, fps=fps)
    try:
        for picture in pictures(env, played, params, fps):
            if not window.show(picture):
                break
    finally:
        window.close()


def require_new(paths: Sequence[Path], overwrite: bool) -> None:
    """Raise ValueError for a path that exists and is not to be replaced."""
    for path in paths:
        if path.exists() and not overwrite:
            raise ValueError(f"{path} exists; accepted: a new path, or --overwrite to replace it")


def require_writable(paths: Sequence[Path]) -> None:
    """Raise OSError naming the file where it cannot be written, before anything is computed."""
    for folder, path in {path.parent: path for path in paths}.items():
        new = not folder.exists()
        _require_room(folder, path)
        if new:
            print(f"New folder: {folder}", file=sys.stderr)


def require_makeable(folder: Path) -> None:
    """Raise OSError naming the folder where it cannot be made or written to; nothing is left."""
    new = [one for one in (folder, *folder.parents) if not one.exists()]
    try:
        _require_room(folder, folder)
    finally:
        for one in new:
            with suppress(OSError):
                one.rmdir()


def _require_room(folder: Path, path: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:  # it names the file that was tried, of which nobody knows
        why = os.strerror(ENOTDIR) if isinstance(error, FileExistsError) else error.strerror
        raise OSError(error.errno, f"cannot be written ({why})", str(path)) from error


def require_folder(out: str | Path) -> None:
    """Raise ValueError for an --out that is to be a directory and is named as a file."""
    path = Path(out)
    if path.suffix.lower() in FILES and not path.is_dir():
        raise ValueError(
            f"--out {path} ends in {path.suffix!r}; accepted: a directory, in which the files get "
            "names of their own"
        )


def require_suffix(path: Path, accepted: tuple[str, ...]) -> None:
    """Raise ValueError for a path of another kind."""
    if path.suffix.lower() not in accepted:
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {', '.join(accepted)}")
