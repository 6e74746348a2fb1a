"""The method "conic": solve a gait problem, prove its result, or name the limit that fails."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.optim.gait.between import peak
from stickslip.optim.gait.convex.answer import (
    Answer,
    answered,
    certificate_of,
    excluded,
    least_demand,
    nothing_left,
    relaxed,
)
from stickslip.optim.gait.convex.limits import FRICTION, NORMAL, TORQUE, ZMP
from stickslip.optim.gait.convex.program import Solved
from stickslip.optim.gait.convex.tighten import held_between
from stickslip.optim.gait.gait import GaitResult
from stickslip.optim.gait.objective import goal_of
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.grid_problem import GridProblem
    from stickslip.optim.gait.problem import GaitProblem

GAP = 1e-6
"""Gap between value and bound, relative to the value or to a twentieth of the objective's size, up
to which a gait counts as proved optimal on its grid."""
CERTIFY = ("every", "grid")
FREE_TORQUE = 100.0
"""Multiple of the torque limit that counts as unlimited in the diagnosis."""
FINER = 4
"""Times as many cells for a torque or a normal force that a message names."""


def solve_conic(
    problem: GaitProblem, *, certify: str = "every", progress: bool = False
) -> GaitResult:
    """The best gait of the grid by second-order cones (cvxpy with Clarabel), with its proofs.

    certify: "every", of every gait, on the grid or off it, with a gait that keeps its limits
    between the nodes and comes to rest nowhere on its way, which takes another solve or more;
    "grid", of gaits of the grid alone: then held and every_bound are None.

    The program of a structure is built once and kept; other numbers solve it again. evaluations:
    how often it was solved. Status: OPTIMAL where the bound of `certificate`, computed without the
    solver, meets the value to 1e-6; INFEASIBLE where that is proved, and the message names the
    limit. details: cells. What the grid leaves open: the result's `discretisation`.
    """
    began = time.perf_counter()
    require_choice("certify", certify, CERTIFY)
    every = certify == "every"
    solver = least_demand if problem.goal.is_friction else answered
    answer = solver(problem.on_grid, every=every)
    if isinstance(answer, Solved):
        status, message, solves = _diagnosed(problem.on_grid, answer)
        return GaitResult.without_point(
            method="conic", status=status, began=began, message=message, evaluations=solves
        )
    evaluation = problem.evaluate_gait(answer.gait)
    held, held_value, more = held_between(answer) if every else (None, np.inf, 0)
    status, message = _judged(answer, evaluation.feasible)
    if every and held is None:
        message += "; no gait was found that keeps its limits between the nodes, too"
    bound = answer.certificate.bound
    return GaitResult.of(
        np.concatenate([[answer.gait.b[0, 0]], answer.gait.a.ravel()]),
        evaluation,
        method="conic",
        status=status,
        began=began,
        lower_bound=min(bound, evaluation.value) if np.isfinite(bound) else None,
        evaluations=answer.solves + more,
        message=message,
        gait=answer.gait,
        held=held,
        held_value=held_value,
        every_bound=answer.every,
        certificate=answer.certificate,
        details={"cells": problem.cells},
    )


def _judged(answer: Answer, feasible: bool) -> tuple[OptimStatus, str]:
    """Status and message of an answer."""
    certificate, solved = answer.certificate, answer.solved
    size = max(abs(certificate.value), 0.05 * answer.problem.scale)
    if not feasible:
        message = f"{solved.message}; the gait misses a limit: see residuals"
        return OptimStatus.VIOLATED, message
    ended = solved.status in (OptimStatus.OPTIMAL, OptimStatus.INACCURATE)
    if certificate.gap <= GAP * size and ended:
        return OptimStatus.OPTIMAL, "proved by the dual"
    status = OptimStatus.INACCURATE if solved.status is OptimStatus.OPTIMAL else solved.status
    values = f"value {certificate.value!r}, proved bound {certificate.bound!r}"
    return status, f"{solved.message}; {values}"


def _diagnosed(problem: GridProblem, ended: Solved) -> tuple[OptimStatus, str, int]:
    """Status, message and how many programs were solved: the limit that fails, and the value that
    it would need. INFEASIBLE only where it is proved."""
    if ended.status is OptimStatus.LIMIT:
        return ended.status, ended.message, 1
    if problem.longest is not None:
        fastest = answered(_fastest(problem))
        if isinstance(fastest, Answer):
            return _too_fast(problem, problem.longest, fastest)
    needed, proved, solves = _needed_values(replace(problem, longest=None))
    if not needed:
        return OptimStatus.FAILED, f"{ended.message}; no limit alone is to blame", solves
    status = OptimStatus.INFEASIBLE if proved else OptimStatus.FAILED
    return status, f"no gait keeps within the limits: {'; or '.join(needed)}", solves


def _fastest(problem: GridProblem) -> GridProblem:
    return replace(problem, goal=goal_of("time", 0.0), longest=None)


def _too_fast(
    problem: GridProblem, longest: float, fastest: Answer
) -> tuple[OptimStatus, str, int]:
    """The mean rate is above the fastest one within the other limits."""
    turn, limits = np.pi * problem.grid.steps, problem.limits
    asked, most = turn / longest, turn / fastest.certificate.value
    held_by, solves = [], 2
    unlimited = {"torque": limits.torque * FREE_TORQUE} if limits.motor else {}
    for name, change in (
        ("the torque limit", unlimited),
        ("the friction's limit", {"mu": None} if limits.mu is not None else {}),
        ("the foot's edges", {"zmp": False} if limits.zmp else {}),
    ):
        if not change:
            continue
        rate, solves = _rate(problem.limited(**change)), solves + 1
        if rate is not None and rate > most * (1 + 1e-3):
            held_by.append(f"{rate:.6g} rad/s without {name}")
    rate = most
    if limits.motor or limits.zmp or limits.mu is not None:
        rate = _rate(problem.limited(torque=limits.torque * FREE_TORQUE, mu=None, zmp=False))
    if rate is not None and rate < asked:
        held_by = [f"above {rate:.6g} rad/s the foot lifts off whatever the motor and the floor"]
    words = f" ({', '.join(held_by)})" if held_by else ""
    if fastest.certificate.bound <= longest:
        text = f"mean_rate = {asked:.6g} rad/s: too near the greatest, {most:.6g} rad/s, to tell"
        return OptimStatus.INACCURATE, text + words, solves + 1
    text = f"mean_rate = {asked:.6g} rad/s cannot be met: at most {most:.6g} rad/s within the"
    return OptimStatus.INFEASIBLE, f"{text} limits{words}", solves + 1


def _rate(problem: GridProblem) -> float | None:
    """Greatest mean rate within the limits [rad/s]."""
    found = answered(_fastest(problem))
    if isinstance(found, Solved):
        return None
    return np.pi * problem.grid.steps / found.certificate.value


def _needed_values(problem: GridProblem) -> tuple[list[str], bool, int]:
    """Needed value of each limit alone, whether infeasibility is proved, and how many programs that
    took."""
    found, proved, solves = [], nothing_left(problem), 0
    for limit in (TORQUE, FRICTION, NORMAL, ZMP):
        if limit not in problem.limits.names or (limit == TORQUE and not problem.limits.motor):
            continue
        text, also, more = _needed(problem, limit)
        proved, solves = proved or also, solves + more
        found += [text] if text else []
    for name, which in (("first", "start_rate"), ("last", "end_rate")):
        low, high = getattr(problem, name)
        if low == high and low > 0 and not problem.periodic:
            free = replace(problem, **{name: (0.0, problem.limits.cap**2)})
            solves += 1
            if _rate(free) is not None:
                found.append(f"{which} = {np.sqrt(low):.6g} rad/s: none such within the limits")
    return found, proved, solves


def _needed(problem: GridProblem, limit: str) -> tuple[str, bool, int]:
    """Needed value of a limit, empty where it alone changes nothing; see `_needed_values`.

    Of a torque what a gait between the nodes takes, too.
    """
    limits = problem.limits
    solved = relaxed(problem, limit)
    if solved.a is None or solved.b is None:
        return "", False, 1
    proved = excluded(problem, solved, every=False)
    if limit == ZMP:
        return "zmp: the foot's edges cannot hold the robot", proved, 1
    if limit == FRICTION and limits.mu is not None:
        least = least_demand(problem.limited(mu=None))
        if not isinstance(least, Answer):
            return "", proved, 2
        text = f"mu = {np.min(limits.mu):.6g}: {least.certificate.value:.6g} is needed"
        return text, proved, 1 + least.solves
    problem = replace(problem, profiles=problem.profiles.finer(FINER))
    cells = f" ({problem.grid.cells} cells a step)"
    solved = relaxed(problem, limit)
    if solved.a is None or solved.b is None:
        return "", proved, 2
    gait = problem.gait_of(solved)
    if limit == NORMAL:  # a crank that stands still may have it, too
        normal = gait.ground_between[1]
        least = -float(np.max(peak(lambda at: -normal(at))))
        text = f"min_normal = {limits.min_normal:.6g} N: at most {least:.6g} N is had"
        return text + cells, proved, 2
    certificate = certificate_of(problem, gait, solved, 0.0, 0.0)
    answer = Answer(gait, certificate, None, solved, problem, 1, limit)
    held, _, solves = held_between(answer)
    torque = (gait if held is None else held).torque_between
    most = float(np.max(peak(lambda at: np.abs(torque(at)))))
    text = f"torque_limit = {limits.torque:.6g} N m: at least {most:.6g} N m is needed"
    return text + cells, proved, 2 + solves
