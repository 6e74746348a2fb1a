"""Training in a directory where a killed run can be resumed.

A run is a chain of stretches, each of which depends on nothing but the checkpoint before it (see
Trainer): a run that was killed and resumed ends with the policy, the metrics and the evaluations of
one that was not, to the last bit on the same machine and versions (the columns of wall-clock time
aside). A run stopped by `stop` (Ctrl-C) adds a checkpoint where it stood; a trainer that starts
anew there goes on with other random numbers.
"""

import math
import shlex
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.agents.evaluation.evaluate import SCORES, scored, task_in_words
from stickslip.agents.evaluation.rollout import play_unseen
from stickslip.agents.evaluation.table import INTERVALS, Measures, row_of_test
from stickslip.agents.machine import Machine, machine_by_name
from stickslip.agents.policy.file import named_task_entry, save_policy
from stickslip.agents.protocol import Options, Player
from stickslip.agents.training import directory as runs
from stickslip.agents.training.configuration import Config, Configuration, Trained, settings_given
from stickslip.agents.training.trainer import Trainer, Update
from stickslip.dynamics.checks import require_kind, reraise
from stickslip.dynamics.lazily import require
from stickslip.envs.functional import AnyEnv
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import measured
from stickslip.optim.progress import Bar, say_stage
from stickslip.records.files import require_folder, write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import with_unit

COST = "cost"
"""Column of evaluations.csv on a task with a cost limit."""
COLUMNS = ("seconds", "steps_per_second", "learning_rate", "noise")
COLUMNS += ("episodes", "return", "duration")
"""First columns of metrics.csv; those of the trainer follow. return, duration [s]: means over the
training episodes that ended."""


def train(
    config: Config | None,
    directory: str | Path,
    *,
    resume: bool = False,
    bar: bool | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Trained[Config]:
    """Train in a directory and return the result. Needs the extra `train`.

    config: may be None to resume. bar: show progress; None shows a bar on a terminal and a line an
    evaluation elsewhere, False nothing. stop: asked after every step; once true, a checkpoint is
    written and Trained.finished is false. ValueError for a directory in use or damaged.
    """
    require_kind("directory", directory, (str, Path), "the path of a new or the run's directory")
    for package in ("filelock", "tqdm"):
        require(package, "training", "train")  # before anything is written
    if config is not None:
        require_kind("config", config, Configuration, "a TrainConfig, a UGVTrainConfig or such")
        task = machine_by_name(config.machine).training_task(config)  # for its ValueError, likewise
        if config.trainer == "sb3" and getattr(task.training, "cost_limit", None) is not None:
            raise ValueError("trainer sb3 with a cost limit; accepted: jax, which keeps it")
        trainer_of(config)
    directory = Path(directory)
    if resume:
        runs.read_config(directory)  # nothing to resume is no reason to make a directory
    with ExitStack() as stack:
        stack.enter_context(runs.only_writer(directory))
        run = runs.open_run(directory, config, resume=resume)
        return _Training(run, bar is not False, stop, stack).train()


def trainer_of(config: Configuration) -> type[Trainer]:
    """The trainer of a configuration. ModuleNotFoundError where a package is missing."""
    if config.trainer == "sb3":
        require("stable_baselines3", "the trainer sb3", "sb3")
        from stickslip.agents.training.sb3 import SB3Trainer

        return SB3Trainer
    from stickslip.agents.training.ppo import PPOTrainer

    return PPOTrainer


class _Training:
    """A run that learns."""

    def __init__(self, run: runs.Run, shown: bool, stop: Callable[[], bool], stack: ExitStack):
        self.run, self.config = run, run.config
        self.machine = machine_by_name(run.config.machine)
        self.task = self.machine.training_task(run.config)
        self.about = self.machine.describe(self.task.env, self.task.described)
        if run.config.task is not None:
            self.about |= named_task_entry(task_by_name(run.config.task))
        self.period = float(np.asarray(self.task.training.control_period))
        at = run.state.timesteps
        given = run.config, self.task.env, self.task.training, self._report, stop
        self.trainer = trainer_of(run.config)(*given)
        if run.latest is not None:
            state = runs.read_model(run.latest)
            with reraise(f"{run.latest}: ", "; accepted: this run's own"):
                self.trainer.put_state(state)
        self.trainer.timesteps = at
        self.seconds, self.since = run.state.seconds, 0.0
        columns = (*COLUMNS, *self.trainer.losses)
        self.metrics = runs.MetricsFile(run.path / "metrics.csv", columns, upto=at)
        self.measures = measures_of(self.machine, run.config, self.task.env)
        columns = tuple(self.measures.columns)
        ends = (f"{name}_{end}" for name in INTERVALS if name in columns for end in ("low", "high"))
        columns = ("seconds", *columns, *ends)
        self.evaluations = runs.MetricsFile(run.path / "evaluations.csv", columns, upto=at)
        self.shown, self.evaluated = shown, False
        total = run.config.timesteps
        bar = Bar("training", total, "step", shown, at=at, large=True, lines=False)
        self.bar, self.bar_at = stack.enter_context(bar), at

    def train(self) -> Trained[Any]:
        """Run the training loop until `timesteps`."""
        self._tidy()
        self._say("compiling the update ...")
        total, interval = self.config.timesteps, self.config.checkpoint_interval
        while (at := self.trainer.timesteps) < total and not self.trainer.stopped:
            self.trainer.begin_stretch()
            self.since = time.monotonic()
            due = min((at // interval + 1) * interval, total)
            self.trainer.advance(due)
            self._lap()
            if self.trainer.timesteps > at:
                self._check_point(evaluated=self.trainer.timesteps >= due)
        at, path = self.trainer.timesteps, self.run.path
        return Trained(path, path / runs.POLICY, self.config, at, self.seconds, at >= total)

    def _report(self, update: Update) -> None:
        """Write a row of metrics, and move the bar."""
        steps, ended = update.timesteps - self.bar_at, update.ended
        rate = steps / max(self._lap(), 1e-9)
        row = {"seconds": self.seconds, "steps_per_second": rate, "episodes": 0, **update.losses}
        row |= {"learning_rate": update.learning_rate, "noise": update.noise}
        if ended:
            row["episodes"] = len(ended["episode_return"])
            row["return"] = float(ended["episode_return"].mean())
            row["duration"] = float(ended["episode_length"].mean()) * self.period
        self.metrics.append(update.timesteps, row)
        self.bar.advance(steps, f"return {row.get('return', math.nan):.2f}")
        self.bar_at = update.timesteps

    def _say(self, line: str) -> None:
        """Print a line, above the bar where there is one."""
        if self.shown:
            self.bar.say(line)

    def _lap(self) -> float:
        """Add the time since the last lap to that spent learning, and return it [s]."""
        now = time.monotonic()
        passed, self.since = now - self.since, now
        self.seconds += passed
        return passed

    def _check_point(self, evaluated: bool) -> None:
        """Write a checkpoint, after the evaluation's row. A stop between two evaluations adds none:
        the best policy would depend on where the run was stopped."""
        at = self.trainer.timesteps
        if not self.trainer.is_finite():
            raise ValueError(
                f"training diverged before step {at}: the policy's parameters are no longer finite "
                "(the checkpoints are whole); accepted: a smaller learning_rate"
            )
        policy = self.trainer.policy()
        if evaluated:
            self._evaluate(at, policy)
        about = {"trained": {"timesteps": at, "config": self.run.state.config}, **self.about}
        state = runs.TrainState(at, self.seconds, self.run.state.config)
        save = partial(save_policy, policy, metadata=about)
        runs.write_checkpoint(self.run.checkpoints, state, self.trainer.take_state(), save)
        self._tidy()

    def _evaluate(self, at: int, policy: Player) -> None:
        """Evaluate the policy after so many steps, and write a row."""
        if not self.evaluated:
            self._say("compiling the evaluation ...")
        self.bar.note("evaluating")
        given = self.task.tested, self.config.evaluation_episodes, self.measures.keep
        kept = play_unseen(self.task.env, policy, *given)
        row, self.evaluated = row_of_test(self.measures.columns, kept), True
        self.evaluations.append(at, {"seconds": self.seconds} | row)
        line = f"score {row[SCORES[0]]:6.3f}  " if SCORES[0] in row else ""
        names = (name for name in dict.fromkeys((*self.machine.evaluated, COST)) if name in row)
        line += "  ".join(f"{name.replace('_', ' ')} {row[name]:.4g}" for name in names)
        self._say(f"{at:>10,} steps  {line.replace('nan', '  -')}")

    def _tidy(self) -> None:
        """Keep the latest checkpoints and the best, the run's policy (at first the latest's)."""
        every = runs.list_checkpoints(self.run.checkpoints)
        steps = best_evaluation(self.run.path)[0]
        best = [one for one in every if int(one.name) == steps] if steps else every[-1:]
        kept = [*every[-self.config.keep_checkpoints :], *best]
        runs.drop_checkpoints(self.run.checkpoints, kept)
        for one in best:
            write_whole(self.run.path / runs.POLICY, runs.require_policy(one))


def best_evaluation(directory: Path) -> tuple[int, float]:
    """Steps and return of a run's best evaluation so far; (0, -inf) before the first.

    Of a task with a cost limit the best that keeps it, or else the one that costs least.
    """
    rows = runs.read_columns(directory / "evaluations.csv")
    steps, earned = rows.get("timesteps", []), rows.get("return", [])
    merits = [(True, one) for one in earned]
    if COST in rows and SCORES[0] in rows:
        kept = map(math.isfinite, rows[SCORES[0]])
        each = zip(kept, earned, rows[COST], strict=True)
        merits = [(kept, one if kept else -cost) for kept, one, cost in each]
    best = max(zip(merits, steps, earned, strict=True), default=(None, 0, -math.inf))
    return int(best[1]), best[2]


def measures_of(machine: Machine, config: Configuration, env: AnyEnv) -> Measures:
    """Measures of a run's evaluations: `evaluated`, and the scores of a named task."""
    measures, shown = machine.measures(env), {*SCORES, *machine.evaluated}
    if config.task is not None:
        task = task_by_name(config.task)
        measures = scored(measures, measured(task.name), task.unit)
        shown |= {COST} if task.cost_limit is not None else set()
    columns = {name: one for name, one in measures.columns.items() if name in shown}
    return replace(measures, columns=columns)


def train_command(given: Options) -> None:
    """`stickslip train`."""
    machine, out, resume = machine_by_name(given["machine"]), given["out"], given["resume"]
    if resume and out is None:
        raise ValueError("--resume needs the run's directory; accepted: with --out DIR")
    changed = settings_given(given, machine.configuration)
    if resume and changed:
        names = ", ".join(changed)
        raise ValueError(
            f"--resume goes on with the run's own configuration; accepted: without {names}"
        )
    config = None if resume else machine.configuration.of(**changed)
    if config is not None and out is None:
        out = f"runs/{config.task or machine.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    require_folder(out)
    directory, where = Path(str(out)), shlex.quote(str(out))
    if config is None and (own := runs.read_config(directory).machine) != machine.name:
        raise ValueError(f"{out} is a run of the {own}; accepted: stickslip train {own} --resume")
    with stoppable() as stop:
        trained = train(config, directory, resume=resume, stop=stop)
    config = trained.config
    machine = machine_by_name(config.machine)
    if not trained.finished:
        again = f"stickslip train {machine.name} --out {where} --resume"
        raise stop.interrupted(f"Stopped after {trained.timesteps:,} steps; go on with: {again}")
    if not given["no_pictures"]:
        say_stage("drawing")
        from stickslip.agents.pictures.training import write_products

        write_products(trained)
    print(
        f"Trained {trained.timesteps:,} steps in {trained.seconds:.0f} s, evaluations aside; "
        f"all of it in {directory}"
    )
    on_task = ""
    if config.task is not None:
        _say_best(trained, config.task)
        on_task = f" --task {config.task}"
    print(f"Compare it: stickslip evaluate{on_task} {where} {' '.join(machine.baselines)}")


def _say_best(trained: Trained[Any], name: str) -> None:
    """Print the best evaluation of a run on a named task, and what its scores mean."""
    (steps, earned), task = best_evaluation(trained.directory), task_by_name(name)
    score = f"score {measured(name).scale.score(earned):.3f}, "
    if task.cost_limit is not None:
        score = "within the cost limit, or else of least cost: "
    best = f"{score}mean return {with_unit(earned, task.unit, 4)}"
    print(f"Best evaluation, after {steps:,} steps, over unseen episodes: {best}")
    print(task_in_words(name))
