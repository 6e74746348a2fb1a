"""The method "conic": solve a gait problem, prove its result, or name the limit that fails.

For a gait whose limits hold between the nodes, too, a little is taken off them where they do not.
Where all weights of the objective are 0, a bound above 0 (`certificate.py`) is a contradiction: a
gait within the limits would have the value 0.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.optim.gait.convex.certificate import Polygons, every_bound, grid_bound
from stickslip.optim.gait.convex.grid_problem import MOTOR, NORMAL, STANDING, UNITS, ZMP, Solved
from stickslip.optim.gait.gait import (
    FRICTION,
    TIME,
    TORQUE,
    Certificate,
    Gait,
    GaitResult,
    Polynomials,
    goal_of,
    lowest,
    peak,
)
from stickslip.optim.problem import Ended, OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.grid_problem import GridProblem, Numbers
    from stickslip.optim.gait.problem import GaitProblem

GAP = 1e-6
"""Gap between value and bound, relative to the value or to a twentieth of the objective's size, up
to which a gait counts as proved optimal on its grid."""
CERTIFY = ("every", "grid")
FREE_TORQUE = 100.0
"""Multiple of the torque limit that counts as unlimited in the diagnosis."""
SLOW = 0.1
"""If the greatest b is less than this of its unit, the unit is reduced and all is solved
again: the solver's accuracy is that of the largest numbers."""
ROUNDS = 30
SETTLED = 1 - 1e-6
"""Ratio of two values in turn from which on the search within the motor's limits ends."""
NO_DEMAND = 1e-9
"""A friction demand below this is none."""
SHORTFALLS = tuple(10.0**-k for k in range(9, 0, -1))
HALVINGS = 4


@dataclass(frozen=True)
class Answer:
    """The gait on the grid, its certificate, a bound on every gait (None: none), and how the solver
    ended. problem: what was solved. relaxed: the limit whose excess was minimised, if one was."""

    gait: Gait
    certificate: Certificate
    every: float | None
    solved: Solved
    problem: GridProblem
    relaxed: str = ""


def answered(problem: GridProblem, again: int = 2, *, every: bool = True) -> Answer | Ended:
    """Solve and certify, `again` times at most in other units. every: bound every gait, too."""
    numbers = problem.numbers()
    solved = problem.solve(numbers)
    if isinstance(solved, Ended):
        return solved
    units, scale = problem.units, problem.scale
    if again and np.max(solved.b) < SLOW:
        rate = units.rate * float(np.sqrt(max(np.max(solved.b), 1e-6)))
        return answered(replace(problem, rate_unit=rate), again - 1, every=every)
    gait = problem.gait_of(solved.a, solved.b)
    value = problem.goal.of(gait.spent_on_grid)
    bound = grid_bound(problem, numbers, solved.duals, (solved.a, gait.b / units.b)) * scale
    proved = max(every_bound(problem, numbers, solved.duals) * scale, 0.0) if every else None
    certificate = certificate_of(problem, gait, solved, value, max(bound, 0.0))
    return Answer(gait, certificate, proved, solved, problem)


def certificate_of(
    problem: GridProblem, gait: Gait, solved: Solved, value: float, bound: float
) -> Certificate:
    """The certificate of a value and a bound: with violation, sign and complementarity."""
    excess = problem.rows.scaled_excess(gait.a, gait.b)
    violation = max(float(np.max(excess)), 0.0)
    multipliers = solved.duals.rows
    total = max(1.0, float(np.sum(np.abs(multipliers))))
    products = float(np.max(np.abs(multipliers * -excess.reshape(multipliers.shape)))) / total
    sign = min(float(np.min(multipliers)) / total, 0.0)
    return Certificate(value, bound, violation, sign, products)


def best_of(problem: GridProblem, *, every: bool) -> Answer | Ended:
    """The gait of the least value, or of the least friction demand."""
    return (least_demand if problem.goal.is_friction else answered)(problem, every=every)


def _converged(problem: GridProblem, gait: Gait) -> tuple[Answer | None, Gait]:
    """The best gait within the tangents about one gait after the other, if any, and the last."""
    best, before = None, np.inf
    for _ in range(ROUNDS):
        at = replace(problem, around=gait.b)
        found = best_of(at, every=False)
        if isinstance(found, Answer):
            if best and found.certificate.value >= best.certificate.value * SETTLED:
                break
            best, gait = found, found.gait
            continue
        nearer = relaxed(at, MOTOR)
        if best or isinstance(nearer, Ended) or nearer.relaxation > SETTLED * before:
            break
        gait, before = at.gait_of(nearer.a, nearer.b), nearer.relaxation
    return best, gait


def within_motor(free: Answer) -> Answer:
    """A gait within the motor's power and torque rate, with the bounds of `free`, the best without.

    By the convex-concave procedure: the limits' tangents about a gait leave only gaits within the
    limits, and that gait if it is one. So the best gait of the program is no worse, and tangents
    are laid about it next. Where those leave no gait, the search goes on at the one that exceeds
    them least. It begins at `free` and at a slow gait. If both end beyond the limits, so does this.
    """
    problem, first = free.problem, free.gait
    if not problem.exceeds_motor(first):
        return free
    a, b = (0 * first.a, np.mean(first.b)) if problem.periodic else (first.a, first.b[0, 0])
    slower = (problem.gait(s * a, s * float(b)) for s in 0.25 ** np.arange(16))
    slow = next((one for one in slower if not problem.exceeds_motor(one)), None)
    problem = replace(problem, mu=None if free.relaxed == FRICTION else problem.mu)
    ends = [_converged(problem, gait) for gait in ((first,) if slow is None else (slow, first))]
    answers = [best for best, _ in ends if best is not None]
    if not answers:
        return replace(free, gait=ends[-1][1])
    answer = min(answers, key=lambda one: one.certificate.value)
    proved = replace(answer.certificate, bound=free.certificate.bound)
    return replace(answer, certificate=proved, every=free.every)


def least_demand(problem: GridProblem, *, every: bool = True) -> Answer | Ended:
    """The least |friction| / normal force, by Dinkelbach's method: at the demand t reached so far
    the gait with the least excess of |friction| over t N has a lower one, and these fall faster
    than geometrically to the least.

    The bound is the greatest t' tried for which the last multipliers prove that no gait gets by
    with t'. every: look for one on every gait, too.
    """
    demand, best, ended = 1.0, None, Ended(OptimStatus.FAILED, "nothing was solved")
    for _ in range(ROUNDS):
        at = _with_friction(problem, demand)
        solved = relaxed(at, FRICTION)
        if isinstance(solved, Ended):
            ended = solved
            break
        gait = at.gait_of(solved.a, solved.b)
        lower = gait.friction_at_nodes
        if best is not None and lower >= demand * (1 - 1e-9):
            break
        best, demand = (gait, solved, at), lower
        if demand < NO_DEMAND:
            break
    if best is None:
        return ended
    gait, last, at = best

    def proved(whole: bool) -> float:
        return _greatest_proved(demand, lambda t: excluded(_with_friction(problem, t), last, whole))

    certificate = certificate_of(at, gait, last, demand, proved(False))
    return Answer(gait, certificate, proved(True) if every else None, last, at, FRICTION)


def relaxed(problem: GridProblem, limit: str) -> Solved | Ended:
    """Least necessary violation r of a limit, in its unit of size, and the solution."""
    return problem.solve(problem.numbers(relaxed=limit))


def excluded(problem: GridProblem, solved: Solved, every: bool) -> bool:
    """True if multipliers prove that no gait keeps to the problem's limits: no gait of the grid,
    or no gait whatever. solved: of `relaxed`, of this problem or one that differs in its rows."""
    given = problem, replace(problem.numbers(), weights={}), solved.duals
    return (every_bound(*given) if every else grid_bound(*given, (solved.a, solved.b))) > 0


def _with_friction(problem: GridProblem, demand: float) -> GridProblem:
    return replace(problem, mu=np.full(problem.grid.steps, demand))


def _greatest_proved(demand: float, proved: Callable[[float], bool]) -> float:
    """About the greatest demand that is proved to be too low."""
    before = 0.0
    for shortfall in SHORTFALLS:
        if proved(demand * (1 - shortfall)):
            low, high = before, shortfall
            for _ in range(HALVINGS if before else 0):
                middle = float(np.sqrt(low * high))
                low, high = (low, middle) if proved(demand * (1 - middle)) else (middle, high)
            return demand * (1 - high)
        before = shortfall
    return 0.0


def solve_conic(
    problem: GaitProblem, *, certify: str = "every", progress: bool = False
) -> GaitResult:
    """The best gait of the grid by second-order cones (cvxpy with Clarabel), with its proofs.

    certify: "every", of every gait, on the grid or off it, with a gait that keeps its limits
    between the nodes and comes to rest nowhere on its way, which takes another solve or more;
    "grid", of gaits of the grid alone: then held and every_bound are None.

    evaluations: programs solved. Status: OPTIMAL where the bound of `certificate`, computed without
    the solver, meets the value to 1e-6; INFEASIBLE where proved, INACCURATE where the grid's own
    error may be why it has no gait; the message names the limit.
    details: cells. What the grid leaves open: the result's `discretisation`.
    """
    began = time.perf_counter()
    require_choice("certify", certify, CERTIFY)
    every = certify == "every"
    at = replace(problem.on_grid, programs=[0])
    answer = best_of(at, every=every)
    if isinstance(answer, Answer):
        answer = within_motor(answer)
    common: dict[str, Any] = {"method": "conic", "began": began}
    if isinstance(answer, Ended):
        status, message = _diagnosed(at, answer)
        message += "" if status is OptimStatus.INFEASIBLE else _unresolved(at)
        return GaitResult.without_point(
            status=status, message=message, evaluations=at.programs[0], **common
        )
    evaluation = problem.evaluate_gait(answer.gait)
    status, message = _judged(answer, evaluation.feasible)
    if not status.solved or (every and (answer.every or 0.0) < evaluation.value / 2):
        message += _unresolved(at)
    weak = at.exceeds_motor(answer.gait)
    if weak:
        message = _too_weak(at, answer.gait)
    held, held_value = None, np.inf
    if every and not weak:
        held, held_value = held_between(answer.problem, answer.gait, answer.relaxed)
        if held is None:
            message += "; no gait was found that keeps its limits between the nodes, too"
    bound = answer.certificate.bound
    return problem.result(
        np.concatenate([[answer.gait.b[0, 0]], answer.gait.a.ravel()]),
        status=status,
        lower_bound=min(bound, evaluation.value) if np.isfinite(bound) else None,
        evaluations=at.programs[0],
        message=message,
        gait=answer.gait,
        held=held,
        held_value=held_value,
        every_bound=answer.every,
        certificate=answer.certificate,
        details={"cells": problem.cells},
        **common,
    )


def _judged(answer: Answer, feasible: bool) -> tuple[OptimStatus, str]:
    """Status and message of an answer."""
    certificate, solved = answer.certificate, answer.solved
    size = max(abs(certificate.value), 0.05 * answer.problem.scale)
    if not feasible:
        return OptimStatus.VIOLATED, f"{solved.message}; the gait misses a limit: see residuals"
    if answer.problem.around is not None and certificate.gap > GAP * size:
        without = "the bound is that without max_power and max_torque_rate"
        return OptimStatus.FEASIBLE, f"a local optimum; {without}"
    ended = solved.status in (OptimStatus.OPTIMAL, OptimStatus.INACCURATE)
    if certificate.gap <= GAP * size and ended:
        return OptimStatus.OPTIMAL, "proved by the dual"
    status = OptimStatus.INACCURATE if solved.status is OptimStatus.OPTIMAL else solved.status
    values = f"value {certificate.value!r}, proved bound {certificate.bound!r}"
    return status, f"{solved.message}; {values}"


def _too_weak(problem: GridProblem, gait: Gait) -> str:
    """The motor's limits, and what a gait needs of them."""
    uses = problem.motor_uses(gait.a, gait.b).items()
    limits = [f"max_{n.replace(' ', '_')} = {most:g} {UNITS[n]}" for n, (_, most) in uses if most]
    needs = [f"{n} {np.max(np.abs(use)):.4g} {UNITS[n]}" for n, (use, _) in uses if np.size(use)]
    return f"no gait was found within {', '.join(limits)}; this one needs: {', '.join(needs)}"


def _diagnosed(problem: GridProblem, ended: Ended) -> tuple[OptimStatus, str]:
    """Status and the limit that fails with the value it needs. INFEASIBLE where the multipliers
    prove it of the grid, and no limit eased by less than the grid's error gives a gait."""
    if ended.status is OptimStatus.LIMIT:
        return ended
    if problem.longest is not None:
        fastest = _fastest(problem)
        if isinstance(fastest, Answer):
            return _too_fast(problem, problem.longest, fastest)
    free = replace(problem, longest=None)
    polygons = Polygons.of(free.sample(inside=False))
    proved, needed, missing = bool(np.any(polygons.low > polygons.high)), [], np.inf
    asked = [TORQUE] if free.motor else []
    for limit in (*asked, FRICTION, NORMAL, ZMP):
        if limit not in free.rows.names:
            continue
        solved = relaxed(free, limit)
        if isinstance(solved, Solved) and solved.relaxation > 0:
            proved |= excluded(free, solved, every=False)
            needed.append(_needed(free, limit, solved))
            missing = min(missing, solved.relaxation)
    needed = [text for text in (*needed, *_needed_rates(free)) if text]
    if not needed:
        return OptimStatus.FAILED, f"{ended.message}; no limit alone is to blame"
    status = OptimStatus.INFEASIBLE if proved else OptimStatus.FAILED
    if proved and missing <= problem.grid.error:
        status = OptimStatus.INACCURATE
    text = f"no gait of the grid of {problem.grid.cells} cells keeps within the limits"
    return status, f"{text}: {'; or '.join(needed)}"


def _unresolved(problem: GridProblem) -> str:
    """What to do about a friction that the grid's own error exceeds; empty for another."""
    least = np.inf if problem.mu is None else float(np.min(problem.mu))
    if least >= problem.grid.error:
        return ""
    cells = f"; a grid of {problem.grid.cells} cells cannot resolve so small a friction as"
    return f"{cells} mu = {least:.6g}: take more cells, or more friction"


def _too_fast(problem: GridProblem, longest: float, fastest: Answer) -> tuple[OptimStatus, str]:
    """The mean rate is above the fastest one within the other limits."""
    turn, proved = problem.grid.turn, fastest.every or 0.0
    asked, most = turn / longest, turn / fastest.certificate.value
    text, cells = f"mean_rate = {asked:.6g} rad/s", problem.grid.cells
    if min(fastest.certificate.bound, proved) <= longest:
        text += f": at most {most:.6g} rad/s on the grid of {cells} cells, others may be faster"
        return OptimStatus.INACCURATE, text
    free = _fastest(replace(problem, torque=problem.torque * FREE_TORQUE, mu=None, zmp=False))
    words = ""
    if isinstance(free, Answer) and (above := turn / free.certificate.value) < asked:
        fast = problem.cap > problem.profiles.nodes.lift_off_rate and problem.min_normal == 0
        why = "the foot lifts off" if fast and problem.periodic else "another limit is missed"
        words = f" (above {above:.6g} rad/s {why} whatever the motor and the floor)"
    text += f" cannot be met: at most {most:.6g} rad/s within the limits{words} on the grid of"
    return OptimStatus.INFEASIBLE, f"{text} {cells} cells, none above {turn / proved:.6g} rad/s"


def _fastest(problem: GridProblem) -> Answer | Ended:
    """The gait of the least time."""
    return answered(replace(problem, goal=goal_of("time", 0.0), longest=None))


def _needed_rates(problem: GridProblem) -> list[str]:
    """Texts of the walk's given ends without which there is a gait."""
    found = []
    for name, which in (("first", "start_rate"), ("last", "end_rate")):
        low, high = getattr(problem, name)
        if low == high and low > 0 and not problem.periodic:
            free = replace(problem, **{name: (0.0, problem.cap**2)})
            if isinstance(_fastest(free), Answer):
                found.append(f"{which} = {np.sqrt(low):.6g} rad/s: none such within the limits")
    return found


def _needed(problem: GridProblem, limit: str, solved: Solved) -> str:
    """Text of the value that a limit needs; empty where it alone changes nothing."""
    if limit == ZMP:
        return "zmp: the foot's edges cannot hold the robot"
    if limit == FRICTION and problem.mu is not None:
        least = least_demand(replace(problem, mu=None), every=False)
        if isinstance(least, Ended):
            return ""
        return f"mu = {np.min(problem.mu):.6g}: {least.certificate.value:.6g} is needed"
    excess = solved.relaxation * problem.rows.size[problem.rows.names.index(limit)]
    if limit == NORMAL:
        least = problem.min_normal - excess
        return f"min_normal = {problem.min_normal:.6g} N: at most {least:.6g} N is had"
    most = problem.torque + excess
    return f"torque_limit = {problem.torque:.6g} N m: at least {most:.6g} N m is needed"


TIGHTENINGS = 9
HELD = 1e-8
"""Tolerated violation of a limit, in its unit of size."""
LAST = 1e-7
"""The same after the last round."""
MOVING, QUARTER = 0.005, 0.25
"""Lower limit of the crank rate: this share of the lift-off rate, or of the mean rate asked for
where that is less. Slower at its crest, a walk is at the mercy of how long a motor holds its
torque: with 4000 holds a step, as in `replay`, half of that may end in a fall backwards."""
STARTED = 0.1 * np.pi
"""Way from rest over which that grows from 0 [rad]."""
MORE = 1.1
"""Factor between tightening and violation: the gait found next bulges elsewhere."""


def held_between(problem: GridProblem, gait: Gait, free: str = "") -> tuple[Gait | None, float]:
    """The gait whose limits hold between the nodes, too, the walk's time included, and its value
    there. free: a limit whose excess is minimised."""
    rows, numbers = problem.rows, problem.numbers(relaxed=free)
    before = np.full_like(numbers.C, np.inf)
    for tolerance in (*[HELD] * TIGHTENINGS, LAST):
        violation, slow = overshoot(problem, gait, free), too_slow(problem, gait)
        late = 0.0 if problem.longest is None else gait.duration / problem.longest - 1
        if max(np.max(violation), np.max(slow), late) <= tolerance:
            goal = problem.goal
            return gait, gait.friction_use if goal.is_friction else goal.of(gait.spent)
        if tolerance == LAST:
            break
        taken = MORE * np.where(violation > HELD, violation, 0.0)
        stuck = violation > np.maximum(before / 2, HELD)
        # There the nodes leave much of the limit: to take less than that off changes nothing.
        spent = (rows.A * gait.a + rows.B * gait.b).reshape(before.shape) / rows.size[:, None]
        taken = taken + np.where(stuck, np.maximum(numbers.C - spent, 0.0), 0.0)
        numbers = _kept_moving(problem, gait, replace(numbers, C=numbers.C - taken), slow)
        before = violation
        if numbers.longest is not None and 0 < late < np.inf:
            took = min(gait.spent_on_grid[TIME] * problem.units.rate, numbers.longest)
            numbers = replace(numbers, longest=took / (1 + late))
        solved = problem.solve(numbers)
        if isinstance(solved, Ended):
            break
        gait = problem.gait_of(solved.a, solved.b)
    return None, np.inf


def overshoot(problem: GridProblem, gait: Gait, free: str = "") -> np.ndarray:
    """Violation of the limits in each cell, assigned to both of its nodes [m, nodes], in units
    of their size, but of `free` and of b >= 0 (see `too_slow`)."""
    rows = problem.rows_between
    between = peak(Polynomials(rows.scaled_excess(*gait.samples)))
    worst = _at_nodes(between).reshape(len(rows.names), -1)
    left_out = np.isin(rows.names, (free, STANDING))
    return np.where(left_out[:, None], -np.inf, worst)


def too_slow(problem: GridProblem, gait: Gait) -> np.ndarray:
    """Shortfall of a cell's least b below its lower limit, at its nodes [nodes], in units of the
    limit's size; in a cell at rest of the b that the acceleration there leads to."""
    grid, least = gait.grid, lowest(gait.grid, gait.a, gait.b)
    share = np.ones_like(least)
    for end, sign in grid.rests:
        least[end, end] = sign * 2 * grid.h[end, end] * gait.a[end, end]
        distance = np.abs(grid.theta[end] - grid.theta[end, end])
        nearer = np.minimum(distance[:-1], distance[1:])
        nearer[end] = grid.h[end, end]
        share[end] = np.minimum(share[end], nearer / STARTED)
    size = problem.rows_between.size[-1]
    asked = np.inf if problem.longest is None else grid.turn / problem.longest
    floor = min(MOVING * problem.profiles.nodes.lift_off_rate, QUARTER * asked) ** 2
    return _at_nodes(floor * share - least).ravel() / size


def _at_nodes(cells: np.ndarray) -> np.ndarray:
    """The larger value of both cells at each node [..., K+1]."""
    none = np.full_like(cells[..., :1], -np.inf)
    left, right = (np.concatenate(pair, axis=-1) for pair in ((cells, none), (none, cells)))
    return np.maximum(left, right)


def _kept_moving(problem: GridProblem, gait: Gait, numbers: Numbers, slow: np.ndarray) -> Numbers:
    """b at a slow cell's nodes, or the acceleration at rest, raised by what is missing."""
    grid, row = gait.grid, problem.rows.names.index(STANDING)
    size = problem.rows_between.size[row]
    A, C, now = numbers.A.copy(), numbers.C.copy(), gait.b.ravel() / size
    for end, sign in grid.rests:
        if slow[end] > 0:
            reach = sign * 2 * grid.h[end, end]
            now[end] = reach * gait.a[end, end] / size
            A[row, end] = -reach * problem.units.b / size
    floor = np.where(slow > 0, now + MORE * slow, -np.inf)
    C[row] = np.minimum(C[row], -floor)
    return replace(numbers, A=A, C=C)
