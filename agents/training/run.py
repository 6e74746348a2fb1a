"""A training run in a directory that a killed run can go on in, whatever learns.

A run is a chain of stretches from one checkpoint to the next. Each starts its generators and
environments anew from the seed and the number of steps so far, or takes them from the checkpoint,
where the trainer keeps them there. So it depends on nothing but the checkpoint before it: a run
that was killed and resumed ends with the policy, the metrics and the evaluations of one that was
not, to the last bit on the same machine and versions (the columns of wall-clock time aside). A run
stopped by `stop` (Ctrl-C) adds a checkpoint where it stood; a trainer that starts anew there goes
on with other random numbers.
"""

from __future__ import annotations

import math
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.policy.file import named_task_entry, save_policy
from stickslip.agents.registry import machine_of_config
from stickslip.agents.training.checkpoint import (
    POLICY,
    TrainState,
    drop_checkpoints,
    folder_name,
    list_checkpoints,
    read_model,
    require_policy,
    write_checkpoint,
)
from stickslip.agents.training.configuration import Configuration, Trained
from stickslip.agents.training.directory import Run, only_writer, open_run, read_config
from stickslip.agents.training.metrics import MetricsFile, read_columns
from stickslip.agents.training.on_task import evaluation_columns, evaluation_row
from stickslip.agents.training.progress import Progress
from stickslip.agents.training.trainer import AnyTrainer, Update, trainer_of
from stickslip.dynamics.plain_checks import require_kind
from stickslip.envs.rendering.extras import require
from stickslip.envs.tasks.definition import task_by_name
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.training.configuration import Config

PACKAGES = ("tensorboard", "filelock", "tqdm")
"""Of the extra `train`, needed whatever learns."""
COLUMNS = ("seconds", "steps_per_second", "learning_rate", "noise")
"""Of metrics.csv, before those of the machine's episodes and of the trainer."""


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
) -> Trained[Config]:
    """Train in a directory and return the result. Needs the extra `train`.

    config: may be None to resume. bar: show progress; None shows a bar on a terminal and a line an
    evaluation elsewhere. after: what the caller does next, in durations of the first evaluation,
    for the remaining time shown. stop: asked after every step; once true, a checkpoint is written
    and Trained.finished is false. devices: that the environments are divided among; default: all
    that divide them evenly. ValueError for a directory in use and for anything damaged in it.
    """
    require_kind("directory", directory, (str, Path), "the path of a new or the run's directory")
    directory = Path(directory)
    with ExitStack() as stack:
        run = _opened(config, directory, stack, resume=resume, overwrite=overwrite)
        return _Training(run, bar, stop, stack, after, devices).train()


def _opened(
    config: Configuration | None,
    directory: Path,
    stack: ExitStack,
    *,
    resume: bool,
    overwrite: bool,
) -> Run:
    """The run to write to, its lock held until the stack is left."""
    if config is not None:
        require_kind("config", config, Configuration, "a TrainConfig, a UGVTrainConfig or such")
    for package in PACKAGES:
        require(package, "training", "train")  # before anything is written
    if config is not None:
        trainer_of(config)  # likewise
        machine_of_config(config).training_task(config)  # for its ValueError
    if resume:
        read_config(directory)  # nothing to resume is no reason to make a directory
    stack.enter_context(only_writer(directory))
    return open_run(directory, config, resume=resume, overwrite=overwrite)


class _Training:
    """A run that learns."""

    def __init__(
        self,
        run: Run,
        bar: bool | None,
        stop: Callable[[], bool],
        stack: ExitStack,
        after: float,
        devices: int | None,
    ):
        from stickslip.agents.training.tensorboard import TensorBoard

        self.run, self.config = run, run.config
        self.machine = machine_of_config(run.config)
        self.task = self.machine.training_task(run.config)
        self.about = self.machine.describe(self.task.env, self.task.tested)
        if run.config.task is not None:
            self.about |= named_task_entry(task_by_name(run.config.task))
        self.period = float(np.asarray(self.task.training.control_period))
        at = run.state.timesteps if run.state else 0
        kind = trainer_of(run.config)
        given = run.config, self.task.env, self.task.training, self._report, stop
        self.trainer = kind(*given) if devices is None else kind(*given, devices)
        stack.callback(self.trainer.close)
        if run.latest is not None:
            _take_up(self.trainer, run.latest)
        self.trainer.timesteps = at
        self.clock = _Clock(run.state.seconds if run.state else 0.0, at)
        self.metrics = MetricsFile(
            run.path / "metrics.csv", metric_columns(self.machine, self.trainer), upto=at
        )
        columns = evaluation_columns(self.machine, run.config, self.task.env)
        self.evaluations = MetricsFile(run.path / "evaluations.csv", ("seconds", *columns), upto=at)
        self.board = stack.enter_context(TensorBoard(run.path / "tensorboard", at))
        self.progress = stack.enter_context(
            Progress(run.config.timesteps, at, bar, machine=self.machine, after=after)
        )

    def train(self) -> Trained[Any]:
        """Stretch after stretch to the end."""
        self._tidy()
        total, interval = self.config.timesteps, self.config.checkpoint_interval
        while (at := self.trainer.timesteps) < total and not self.trainer.stopped:
            self.trainer.begin_stretch(at)
            self.clock.begin(at)
            self.trainer.advance(min((at // interval + 1) * interval, total))
            self.clock.stop()
            if self.trainer.timesteps > at:
                self._check_point()
        return Trained(
            self.run.path,
            self.run.path / POLICY,
            self.config,
            self.trainer.timesteps,
            self.clock.seconds,
            self.trainer.timesteps >= total,
        )

    def _report(self, update: Update) -> None:
        """Write a row of metrics, and show it."""
        rate = self.clock.lap(update.timesteps)
        ended = update.ended
        row = {
            "seconds": self.clock.seconds,
            "steps_per_second": rate,
            "learning_rate": update.learning_rate,
            "noise": update.noise,
            **(self.machine.summary(ended, self.period) if ended else {"episodes": 0}),
            **update.losses,
        }
        self.metrics.append(update.timesteps, row)
        self.board.add("train", update.timesteps, row)
        self.progress.show(update.timesteps, row)

    def _check_point(self) -> None:
        """Evaluate the policy and write it all down. The evaluation's row comes first: a checkpoint
        that exists has one."""
        at, seconds = self.trainer.timesteps, self.clock.seconds
        if not self.trainer.is_finite():
            raise ValueError(
                f"training diverged before step {at}: the policy's parameters are no longer finite "
                "(the checkpoints are whole); accepted: a smaller learning_rate"
            )
        policy = self.trainer.policy()
        row = evaluation_row(self.machine, self.task, policy, self.config)
        self.evaluations.append(at, {"seconds": seconds} | row)
        self.board.add("evaluation", at, row)
        self.progress.tell(at, row)
        about = {"trained": {"timesteps": at, "config": self.config.digest}, **self.about}
        state = TrainState(at, seconds, self.config.digest)
        write_checkpoint(
            self.run.checkpoints,
            state,
            self.trainer.take_state(),
            lambda path: save_policy(policy, path, about),
        )
        self._tidy()

    def _tidy(self) -> None:
        """Keep the latest checkpoints and the best, whose policy becomes the run's."""
        every = list_checkpoints(self.run.checkpoints)
        best = self.run.checkpoints / folder_name(best_evaluation(self.run.path)[0])
        drop_checkpoints(self.run.checkpoints, [*every[-self.config.keep_checkpoints :], best])
        if best in every:
            write_whole(self.run.path / POLICY, require_policy(best))


class _Clock:
    """Time spent learning, evaluations and checkpoints aside. seconds: so far [s]."""

    def __init__(self, seconds: float, timesteps: int):
        self.seconds, self._timesteps, self._since = seconds, timesteps, 0.0

    def begin(self, timesteps: int) -> None:
        """A stretch begins."""
        self._timesteps, self._since = timesteps, time.monotonic()

    def lap(self, timesteps: int) -> float:
        """So many steps were made; the rate since the last lap [1/s]."""
        now, gone = time.monotonic(), timesteps - self._timesteps
        passed = now - self._since
        self.seconds, self._since, self._timesteps = self.seconds + passed, now, timesteps
        return gone / max(passed, 1e-9)

    def stop(self) -> None:
        """The stretch ends."""
        self.seconds += time.monotonic() - self._since


def best_evaluation(directory: Path) -> tuple[int, float]:
    """Steps and return of a run's best evaluation so far; (0, -inf) before the first."""
    rows = read_columns(directory / "evaluations.csv")
    pairs = zip(rows.get("timesteps", []), rows.get("return", []), strict=True)
    best = max(pairs, key=lambda pair: (pair[1], pair[0]), default=(0, -math.inf))
    return int(best[0]), best[1]


def metric_columns(machine: AnyMachine, trainer: AnyTrainer) -> tuple[str, ...]:
    """Columns of metrics.csv after the number of steps."""
    return (*COLUMNS, *machine.episode, *trainer.losses)


def _take_up(trainer: AnyTrainer, checkpoint: Path) -> None:
    """Go on from a checkpoint. ValueError naming it where it is of something else."""
    state = read_model(checkpoint)
    try:
        trainer.put_state(state)
    except ValueError as error:
        raise ValueError(f"{checkpoint}: {error}; accepted: this run's own") from error
