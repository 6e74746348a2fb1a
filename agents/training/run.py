"""Train a policy in a directory that a killed run can go on in.

A run is a chain of stretches from one checkpoint to the next. Each starts its generators and
environments anew from the seed and the number of steps so far, so it depends on nothing but the
checkpoint before it: a run that was killed and resumed ends with the policy, the metrics and the
evaluations of one that was not, to the last bit on the same machine and versions (the columns of
wall-clock time aside). A run stopped by `stop` (Ctrl-C) adds a checkpoint where it stood, and so
goes on with other random numbers.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.agents.biped.evaluate import INTERVALS
from stickslip.agents.machines import Machine, machine_of
from stickslip.agents.policy import from_sb3, save_policy
from stickslip.agents.training.checkpoint import (
    POLICY,
    TrainState,
    drop_checkpoints,
    folder_name,
    list_checkpoints,
    read_model,
    write_checkpoint,
)
from stickslip.agents.training.directory import Run, only_writer, open_run, read_config
from stickslip.agents.training.metrics import MetricsFile, read_columns
from stickslip.agents.training.progress import Progress
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.training.configuration import Configuration

PACKAGES = ("stable_baselines3", "tensorboard", "filelock", "tqdm")
"""Of the extra `train`, needed to train at all."""


class Trained(NamedTuple):
    """What came of a call of `train`."""

    directory: Path
    policy: Path
    """The policy of the best evaluation."""
    config: Any
    """The machine's configuration."""
    timesteps: int
    seconds: float
    """Trained in all, over every resumption [s]."""
    finished: bool

    @property
    def percent(self) -> int:
        """How much of the training is done, 100 at its end only."""
        return min(100 * self.timesteps // self.config.timesteps, 100)

    @property
    def name(self) -> str:
        """What to call the policy: one that is not trained to the end says so."""
        if self.finished:
            return "trained policy"
        return f"policy after {self.percent} % of its training"


def train(
    config: Configuration | None,
    directory: str | Path,
    *,
    resume: bool = False,
    overwrite: bool = False,
    bar: bool | None = None,
    stop: Callable[[], bool] = lambda: False,
    after: float = 0.0,
) -> Trained:
    """Train in a directory and return what came of it. Needs the extra `train`.

    config: may be None to resume. bar: show progress; None shows a bar on a terminal and a line an
    evaluation elsewhere. after: what the caller does next, in durations of the first evaluation,
    for the remaining time shown. stop: asked after every step; once true, a checkpoint is written
    and Trained.finished is false. ValueError for a directory in use and for anything damaged in it.
    """
    directory = Path(directory)
    for package in PACKAGES:
        import_module(package)  # before anything is written
    if config is not None:
        machine_of(config).make_task(config)  # for its ValueError
    if resume:
        read_config(directory)  # nothing to resume is no reason to make a directory
    with only_writer(directory), ExitStack() as stack:
        run = open_run(directory, config, resume=resume, overwrite=overwrite)
        return _Trainer(run, bar, stop, stack, after).train()


class _Trainer:
    """One process's part of a run."""

    def __init__(
        self,
        run: Run,
        bar: bool | None,
        stop: Callable[[], bool],
        stack: ExitStack,
        after: float,
    ):
        from stickslip.agents.training.sb3.algorithm import Course, make_model, put_state
        from stickslip.agents.training.sb3.callback import Reporter, metric_columns
        from stickslip.agents.training.tensorboard import TensorBoard
        from stickslip.envs.adapters.sb3 import SB3VecEnv

        self.run, self.config = run, run.config
        self.machine = machine_of(run.config)
        self.task = self.machine.make_task(run.config)
        self.about = self.machine.about(self.task)
        at = run.state.timesteps if run.state else 0
        envs = SB3VecEnv(self.task.env, self.task.training, run.config.num_envs, run.config.seed)
        course = Course(at / run.config.timesteps)
        self.model = make_model(run.config, envs, course)
        if run.latest is not None:
            try:
                put_state(self.model, read_model(run.latest))
            except ValueError as error:
                raise ValueError(f"{run.latest}: {error}; accepted: this run's own") from error
        self.model.num_timesteps = at
        self.metrics = MetricsFile(
            run.path / "metrics.csv", metric_columns(run.config.algorithm, self.machine), upto=at
        )
        self.evaluations = MetricsFile(
            run.path / "evaluations.csv", ("seconds", *_evaluation_columns(self.machine)), upto=at
        )
        self.board = stack.enter_context(TensorBoard(run.path / "tensorboard", at))
        self.progress = stack.enter_context(
            Progress(run.config.timesteps, at, bar, machine=self.machine, after=after)
        )
        period = float(np.asarray(self.task.training.control_period))
        self.reporter = Reporter(run.config, self.machine, course, period, self._report, stop)
        self.reporter.seconds = run.state.seconds if run.state else 0.0
        stack.callback(envs.close)

    def train(self) -> Trained:
        """Stretch after stretch to the end."""
        from stickslip.agents.training.sb3.algorithm import begin_stretch

        self._tidy()
        total, interval = self.config.timesteps, self.config.checkpoint_interval
        while (at := self.model.num_timesteps) < total and not self.reporter.stopped:
            begin_stretch(self.model, self.config.seed, at)
            goal = min((at // interval + 1) * interval, total)
            self.model.learn(
                goal - at, self.reporter, log_interval=10**9, reset_num_timesteps=False
            )
            if self.model.num_timesteps > at:
                self._check_point()
        return Trained(
            self.run.path,
            self.run.path / POLICY,
            self.config,
            self.model.num_timesteps,
            self.reporter.seconds,
            self.model.num_timesteps >= total,
        )

    def _report(self, timesteps: int, row: dict[str, float]) -> None:
        self.metrics.append(timesteps, row)
        self.board.add("train", timesteps, row)
        self.progress.show(timesteps, row)

    def _check_point(self) -> None:
        """Evaluate the policy and write it all down. The evaluation's row comes first: a checkpoint
        that exists has one."""
        from stickslip.agents.training.sb3.algorithm import is_finite, take_state

        at, seconds = self.model.num_timesteps, self.reporter.seconds
        if not is_finite(self.model):
            raise ValueError(
                f"training diverged before step {at}: the policy's parameters are no longer finite "
                "(the checkpoints are whole); accepted: a smaller learning_rate"
            )
        policy = from_sb3(self.model)
        row = self.machine.evaluate_policy(self.task, policy, self.config)
        self.evaluations.append(at, {"seconds": seconds} | row)
        self.board.add("evaluation", at, row)
        self.progress.tell(at, row)
        about = {"trained": {"timesteps": at, "config": self.config.digest}, **self.about}
        state = TrainState(at, seconds, self.config.digest)
        write_checkpoint(
            self.run.checkpoints,
            state,
            take_state(self.model),
            lambda path: save_policy(policy, path, about),
        )
        self._tidy()

    def _tidy(self) -> None:
        """Keep the latest checkpoints and the best, whose policy becomes the run's."""
        every = list_checkpoints(self.run.checkpoints)
        best = self.run.checkpoints / folder_name(best_evaluation(self.run.path)[0])
        drop_checkpoints(self.run.checkpoints, [*every[-self.config.keep_checkpoints :], best])
        if best in every:
            write_whole(self.run.path / POLICY, (best / POLICY).read_bytes())


def best_evaluation(directory: Path) -> tuple[int, float]:
    """Steps and return of a run's best evaluation so far; (0, -inf) before the first."""
    rows = read_columns(directory / "evaluations.csv")
    pairs = zip(rows.get("timesteps", []), rows.get("return", []), strict=True)
    best = max(pairs, key=lambda pair: (pair[1], pair[0]), default=(0, -math.inf))
    return int(best[0]), best[1]


def _evaluation_columns(machine: Machine) -> tuple[str, ...]:
    return (*machine.EVALUATED, *(f"{name}_{end}" for name in INTERVALS for end in ("low", "high")))
