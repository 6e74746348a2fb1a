"""Solve a gait problem as a cone program, and prove its result independently of the solver."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.optim.gait.convex.answer import Answer, answered
from stickslip.optim.gait.convex.demand import least_demand
from stickslip.optim.gait.convex.program import Solved
from stickslip.optim.gait.convex.tighten import held_between
from stickslip.optim.gait.proof.infeasible import blamed
from stickslip.optim.gait.result import GaitResult
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.gait.problem import GaitProblem

GAP = 1e-6
"""Gap between value and bound, relative to the value or to a twentieth of the objective's size, up
to which a gait counts as proved optimal on its grid."""
CERTIFY = ("every", "grid")


def solve_conic(
    problem: GaitProblem, *, certify: str = "every", progress: bool = False
) -> GaitResult:
    """The best gait of the grid by second-order cones (cvxpy with Clarabel), with its proofs.

    certify: "every", of every gait, on the grid or off it, with a gait that keeps its limits
    between the nodes and comes to rest nowhere on its way, which takes another solve or more;
    "grid", of gaits of the grid alone: then held and every_bound are None.

    The program of a structure is built once and kept; other numbers solve it again. evaluations:
    how often it was solved. Status: OPTIMAL where the bound of `certificate`, worked out apart from
    the solver, meets the value to 1e-6; INFEASIBLE where that is proved, and the message names the
    limit. details: cells. What the grid leaves open: the result's `discretisation`.
    """
    began = time.perf_counter()
    require_choice("certify", certify, CERTIFY)
    instance, whole = problem.instance, certify == "every"
    found = least_demand if instance.goal.is_friction else answered
    answer = found(instance, every=whole)
    if isinstance(answer, Solved):
        status, message, solves = blamed(instance, answer)
        return GaitResult.without_point(
            method="conic",
            status=status,
            began=began,
            message=message,
            evaluations=solves,
        )
    certificate, solved = answer.certificate, answer.solved
    evaluation = problem.looked_at(answer.gait)
    held, held_value, more = held_between(answer) if whole else (None, np.inf, 0)
    status, message = _judged(problem, answer, evaluation.feasible)
    if whole and held is None:
        message += "; no gait was found that keeps its limits between the nodes, too"
    proved = np.isfinite(certificate.bound)
    every = answer.every
    x = np.concatenate([[answer.gait.b[0, 0]], answer.gait.a.ravel()])
    return GaitResult.of(
        x,
        evaluation,
        method="conic",
        status=status,
        began=began,
        lower_bound=min(certificate.bound, evaluation.value) if proved else None,
        evaluations=answer.solves + more,
        message=message or solved.words,
        gait=answer.gait,
        held=held,
        held_value=held_value,
        every_bound=every,
        certificate=certificate,
        details={"cells": problem.cells},
    )


def _judged(problem: GaitProblem, answer: Answer, feasible: bool) -> tuple[OptimStatus, str]:
    """The status that the answer has earned."""
    certificate, solved = answer.certificate, answer.solved
    size = max(abs(certificate.value), 0.05 * answer.instance.scale)
    if not feasible:
        return OptimStatus.VIOLATED, f"{solved.words}; the gait misses a limit: see residuals"
    if certificate.gap <= GAP * size and solved.status in (
        OptimStatus.OPTIMAL,
        OptimStatus.INACCURATE,
    ):
        return OptimStatus.OPTIMAL, "proved by the dual"
    status = OptimStatus.INACCURATE if solved.status is OptimStatus.OPTIMAL else solved.status
    text = f"{solved.words}; value {certificate.value!r}, proved bound {certificate.bound!r}"
    return status, text
