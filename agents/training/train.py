"""Training of any machine into a directory, with a report beside the data at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.training import run
from stickslip.agents.training.trained import Trained

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from stickslip.agents.training.configuration import Config

__all__ = ["Trained", "train"]


def train(
    config: Config | None,
    directory: str | Path,
    *,
    resume: bool = False,
    overwrite: bool = False,
    bar: bool | None = None,
    stop: Callable[[], bool] = lambda: False,
    after: float = 0.0,
    devices: int | None = None,
    report: bool = True,
) -> Trained[Config]:
    """Train in a directory and return what came of it. Needs the extra `train`.

    config: may be None to resume. bar: show progress; None shows a bar on a terminal and a line an
    evaluation elsewhere. after: what the caller does next, in durations of the first evaluation,
    for the remaining time shown. stop: asked after every step; once true, a checkpoint is written
    and Trained.finished is false. devices: that the environments are divided among; default: all
    that divide them evenly. ValueError for a directory in use and for anything damaged in it.

    report: once the training is finished, report.html is written beside its data: curves of the
    whole run, resumptions included, the configuration, and the policy's episode of seed 0, whose
    program takes some seconds to compile. Where that fails, a RuntimeWarning says so.
    """
    trained = run.train(
        config,
        directory,
        resume=resume,
        overwrite=overwrite,
        bar=bar,
        stop=stop,
        after=after,
        devices=devices,
    )
    if report and trained.finished:
        from stickslip.agents.reports.trained import report_training

        report_training(trained)
    return trained
