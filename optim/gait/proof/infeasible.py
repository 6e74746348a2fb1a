"""Diagnosis of an infeasible gait: the limit that fails, and the value that it would need."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.between import peak
from stickslip.optim.gait.convex.answer import Answer, answered, conditions
from stickslip.optim.gait.convex.demand import least_demand
from stickslip.optim.gait.convex.goal import goal_of
from stickslip.optim.gait.convex.limits import FRICTION, NORMAL, TORQUE, ZMP
from stickslip.optim.gait.convex.tighten import held_between
from stickslip.optim.gait.proof.impossible import excluded, nothing_left, relaxed
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.instance import Instance
    from stickslip.optim.gait.convex.program import Solved

FREE_TORQUE = 100.0
"""Multiple of the torque limit that counts as unlimited in the diagnosis."""

FINER = 4
"""Times as many cells for a torque or a normal force that a message names."""


def blamed(instance: Instance, ended: Solved) -> tuple[OptimStatus, str, int]:
    """Status, message and how many programs were solved. INFEASIBLE only where it is proved."""
    if ended.status is OptimStatus.LIMIT:
        return ended.status, ended.words, 1
    if instance.longest is not None:
        fastest = answered(_fastest(instance))
        if isinstance(fastest, Answer):
            return _too_fast(instance, fastest)
    found, proved, solves = _short(instance.towards(longest=None))
    if not found:
        return OptimStatus.FAILED, f"{ended.words}; no limit alone is to blame", solves
    status = OptimStatus.INFEASIBLE if proved else OptimStatus.FAILED
    return status, f"no gait keeps within the limits: {'; or '.join(found)}", solves


def _fastest(instance: Instance) -> Instance:
    return instance.towards(goal=goal_of("time", 0.0), longest=None)


def _too_fast(instance: Instance, fastest: Answer) -> tuple[OptimStatus, str, int]:
    """The mean rate is above the fastest one within the other limits."""
    turn, limits = np.pi * instance.grid.steps, instance.limits
    asked = turn / (instance.longest or np.inf)
    bound = fastest.certificate.bound
    most = turn / fastest.certificate.value
    proved = bound > (instance.longest or np.inf)
    text = (
        f"mean_rate = {asked:.6g} rad/s cannot be met: at most {most:.6g} rad/s within the limits"
    )
    held_by, solves = [], 2
    for name, other in _without(instance):
        quicker = answered(_fastest(other))
        solves += 1
        if isinstance(quicker, Answer):
            rate = turn / quicker.certificate.value
            if rate > most * (1 + 1e-3):
                held_by.append(f"{rate:.6g} rad/s without {name}")
    bare = answered(_fastest(_bare(instance)))
    if not (limits.motor or limits.zmp or limits.mu is not None):
        bare = fastest
    if isinstance(bare, Answer) and turn / bare.certificate.value < asked:
        rate = turn / bare.certificate.value
        held_by = [f"above {rate:.6g} rad/s the foot lifts off whatever the motor and the floor"]
    words = f" ({', '.join(held_by)})" if held_by else ""
    if not proved:
        text = f"mean_rate = {asked:.6g} rad/s: too near the greatest, {most:.6g} rad/s, to tell"
        return OptimStatus.INACCURATE, text + words, solves + 1
    return OptimStatus.INFEASIBLE, text + words, solves + 1


def _without(instance: Instance) -> list[tuple[str, Instance]]:
    """The instance without each of its limits in turn."""
    limits = instance.limits
    found: list[tuple[str, Instance]] = []
    if limits.motor:
        found.append(("the torque limit", instance.use(torque=limits.torque * FREE_TORQUE)))
    if limits.mu is not None:
        found.append(("the friction's limit", instance.use(mu=None)))
    if limits.zmp:
        found.append(("the foot's edges", instance.use(zmp=False)))
    return found


def _bare(instance: Instance) -> Instance:
    """The normal force's limit alone."""
    return instance.use(torque=instance.limits.torque * FREE_TORQUE, mu=None, zmp=False)


def _short(instance: Instance) -> tuple[list[str], bool, int]:
    """Needed value of each limit alone, whether infeasibility is proved,
    and how many programs that took."""
    found, proved, solves = [], nothing_left(instance), 0
    for limit in (TORQUE, FRICTION, NORMAL, ZMP):
        if limit not in instance.limits.names or (limit == TORQUE and not instance.limits.motor):
            continue
        text, also, more = _needed(instance, limit)
        proved, solves = proved or also, solves + more
        found += [text] if text else []
    for name, which in (("first", "start_rate"), ("last", "end_rate")):
        low, high = getattr(instance, name)
        if low == high and low > 0 and not instance.periodic:
            free = instance.towards(**{name: (0.0, instance.limits.cap**2)})
            solves += 1
            if isinstance(answered(_fastest(free)), Answer):
                found.append(f"{which} = {np.sqrt(low):.6g} rad/s: none such within the limits")
    return found, proved, solves


def _needed(instance: Instance, limit: str) -> tuple[str, bool, int]:
    """Needed value of a limit, empty where it alone changes nothing; see `_short`.

    Of a torque what a gait between the nodes takes, too.
    """
    limits = instance.limits
    _, solved = relaxed(instance, limit)
    if solved.a is None or solved.b is None:
        return "", False, 1
    proved = excluded(instance, solved, every=False)
    if limit == ZMP:
        return "zmp: the foot's edges cannot hold the robot", proved, 1
    if limit == FRICTION and limits.mu is not None:
        least = least_demand(instance.use(mu=None))
        if not isinstance(least, Answer):
            return "", proved, 2
        text = f"mu = {np.min(limits.mu):.6g}: {least.certificate.value:.6g} is needed"
        return text, proved, 1 + least.solves
    instance = instance.finer(FINER)
    _, solved = relaxed(instance, limit)
    if solved.a is None or solved.b is None:
        return "", proved, 2
    gait = instance.gait_of(solved)
    if limit == NORMAL:  # a crank that stands still may have it, too
        normal = gait.ground_between[1]
        least = -float(np.max(peak(lambda at: -normal(at))))
        text = f"min_normal = {limits.min_normal:.6g} N: at most {least:.6g} N is had"
        return f"{text} ({instance.grid.cells} cells a step)", proved, 2
    certificate = conditions(instance, gait, solved, 0.0, 0.0)
    answer = Answer(gait, certificate, None, solved, instance, 1, limit)
    held, _, solves = held_between(answer)
    torque = (gait if held is None else held).torque_between
    most = float(np.max(peak(lambda at: np.abs(torque(at)))))
    text = f"torque_limit = {limits.torque:.6g} N m: at least {most:.6g} N m is needed"
    return f"{text} ({instance.grid.cells} cells a step)", proved, 2 + solves
