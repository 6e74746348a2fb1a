"""Evaluation in bulk: policies on tasks at every point of a grid, into a directory."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.evaluation.given import require_named
from stickslip.agents.reports.writing import written_or_told
from stickslip.agents.sweeps.design import design_of
from stickslip.agents.sweeps.files.chunks import Chunks
from stickslip.agents.sweeps.files.directory import missing_chunks, open_sweep
from stickslip.agents.sweeps.named import played_on
from stickslip.agents.sweeps.plan import Plan
from stickslip.agents.sweeps.playing.engine import Watch, run_here, threads_of
from stickslip.agents.sweeps.playing.progress import Progress
from stickslip.agents.training.directory import only_writer
from stickslip.optim.progress import say_stage

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from stickslip.agents.sweeps.axis import AxisLike
    from stickslip.agents.sweeps.named import Policies, Tasks


@dataclass(frozen=True)
class Swept:
    """What a sweep has done. programs: compiled in this process, None where workers did.

    chunks: all there are; played: how many of them this call played. report: the page about it,
    None where none was asked for or could be written.
    """

    path: Path
    episodes: int
    chunks: int
    played: int
    programs: int | None
    report: Path | None = None


def sweep(
    task: Tasks,
    policies: Policies,
    axes: Mapping[str, AxisLike],
    episodes: int = 32,
    out: str | Path = "sweep",
    *,
    samples: int | None = None,
    design_seed: int = 0,
    independent: bool = False,
    summaries: bool = False,
    chunk: int | None = None,
    tile: int | None = None,
    cores: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
    report: bool = True,
) -> Swept:
    """Play episodes of every policy on every task at every point of the axes, and write them.

    task: the name of a task of the ladder, (env, params), or several of either, a list of names or
    a dict by labels of one's own. policies: names (baselines, files), or controllers by name. axes:
    by names of fields, dotted or in short (see docs/sweeps.md), each an `Axis`, its text
    ("0.02:0.3:64", "1:100:5:log", "0.1,0.2", "0.02:0.3:sobol") or values. samples: points that
    random axes draw together, from design_seed.

    Each point gets the episodes of seeds 0, 1, ..., as `evaluate` does: the same draws at every
    point, or with independent=True draws that the axes' values decide, too. No result depends on
    chunks, cores, workers or their order.

    out: a directory of its own, which `read_sweep` reads: a row an episode or, with summaries=True,
    a row a point. chunk: episodes of a chunk, and tile: of a program's call, by default what suits
    memory and cores. cores: chunks played at once, by default one for each core or device.
    workers: so many processes of this machine instead; scheduler: those of a Dask scheduler at
    that address.

    resume: go on with the same sweep in `out`. overwrite: begin it anew. progress: a bar, or lines
    where there is no terminal. stop: asked now and then; StoppedError where it says so, and what is
    written can be resumed.

    report: at the end summary.txt, pictures (where matplotlib is installed) and report.html are
    written beside the data, of the whole sweep, in place of those that are there. The page has a
    few of the episodes, which are played again: a program for each policy that is shown. Where that
    fails, a RuntimeWarning says so.

    ValueError for unknown axes, values that a task does not take, policies of something else, a
    directory of something else. MemoryError where not even one episode fits.
    """
    require_named("axes", axes, '{"mu": "0.02:0.3:64"} or such')
    machine, played = played_on(task, policies)
    machine.swept().require_no_structure(axes)
    design = design_of(dict(axes), samples, design_seed)
    plan = Plan.of(
        machine,
        played,
        design,
        episodes=episodes,
        independent=independent,
        summaries=summaries,
    )
    done = run_plan(
        plan,
        Path(out),
        chunk=chunk,
        tile=tile,
        cores=cores,
        workers=workers,
        scheduler=scheduler,
        resume=resume,
        overwrite=overwrite,
        progress=progress,
        stop=stop,
    )
    if not report:
        return done
    from stickslip.agents.reports.swept import report_sweep

    say = say_stage if progress else lambda stage: None
    told = written_or_told(done.path, lambda: report_sweep(plan, done.path, say=say))
    return done if told is None else replace(done, report=told.report)


def run_plan(
    plan: Plan,
    path: Path,
    *,
    chunk: int | None = None,
    tile: int | None = None,
    cores: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> Swept:
    """`sweep`, of a plan."""
    beyond = workers is not None or scheduler is not None
    if beyond and cores is not None:
        raise ValueError("cores beside workers or a scheduler; accepted: one of them")
    threads = threads_of(cores if workers is None else workers)
    plan = plan.cut(chunk, threads, tile)
    with only_writer(path, "sweeping"):
        plan = open_sweep(path, plan, resume=resume, overwrite=overwrite, chunk=chunk)
        todo, work = missing_chunks(path, plan), Chunks(plan, path)
        left = sum(map(work.size, todo))
        with Progress(plan.total, plan.total - left, progress) as told:
            watch = Watch(told.advance, stop)
            if beyond:
                from stickslip.agents.sweeps.playing.cluster import run_beyond

                run_beyond(work, todo, watch, workers=workers, scheduler=scheduler)
                programs = None
            else:
                run_here(work, todo, threads, watch)
                programs = work.player.programs.count
    return Swept(path, plan.total, len(plan.chunks), len(todo), programs)
