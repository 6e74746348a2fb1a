"""Friction, load and the encoder's errors from the log of a walk, by maximum likelihood."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from stickslip.dynamics import checks
from stickslip.dynamics.biped import BipedParams, RK4Split, prepare
from stickslip.dynamics.biped.estimation import LOADS, Belief, Noise, initial_belief, observe
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.names import UNKNOWNS
from stickslip.dynamics.pytrees import read_only, settle
from stickslip.dynamics.scene import Uniform
from stickslip.optim.columns import TIME, TORQUE, ColumnSpec, read_columns
from stickslip.optim.problem import padded
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Float

COLUMNS = (TIME, TORQUE, ColumnSpec("crank angle", "rad", ("crank_angle", "theta")))
LEAST_ROWS, LEAST_NOISE = 20, 1e-4
LONGEST_STEP, GAP = 0.005, 1.5
"""Of the filter's prediction [s]; rows that are longer than so many usual ones are gaps."""
ROW = 1000
"""Memory of a row [bytes], about."""
FRICTION = (0.005, 1.5)
"""Static frictions that are searched."""
RATIO = (0.3, 1.0)
"""Kinetic over static frictions that are searched."""
GRID = (24, 6)
MEMBERS, BEST = 48, 8
"""Frictions tried in each round, and those that the next round is drawn from."""
DISTURBANCES = 0.25 * 0.5 ** np.arange(9)
"""Noise of the torque in one stage of the search after the other [N m]: with a large one the
likelihood is smooth, with a small one it is sharp."""
FIRST = (2, 4, 0)
"""Stages to begin at, with a grid of frictions."""
ROUNDS = 3
"""Of a stage."""
NARROW = 2e-4
"""Least spread of frictions that are drawn, relative."""
WIDER = 1.5
"""Factor of the variance of the best frictions for those of the next round."""
HOPELESS = 200.0
"""Increase of the misfit from one stage to the next that ends the search."""
JOINT = 5.99
"""-2 log of the likelihood ratio at the edge of a region of 95 % for two frictions."""
SIGMAS = 1.96
GRIP = 10.0
"""A friction under which no foot slips [-]."""
START = 0.05
"""Deviation of the first crank rate beside what noise makes of it [rad/s]."""
PRIOR, FREE = 3.0, 10.0
"""Factors of the unknowns' deviations for the next round, and for the intervals."""
LAST, MOST_ROUNDS, PATIENCE, GROWTH = 48, 32, 5, 0.03
"""Frictions tried in a round for intervals; the most rounds; the last ones, in which the region
grows by less than this share of its size."""
REACH = (1.4, 4.0)
"""Sizes of the ellipses that three in four and the others are drawn from, in the region's own."""
MISFIT = itemgetter(0)
"""Of a stage."""
FIT = 1.5
"""Mean square of the relative innovations above which the model does not explain a log."""
SCATTER = 7.5
"""With the noise of a log of n rows, mere noise exceeds exp(SCATTER / sqrt(n)) in 1 % of logs: its
median scatters by 1.5 / sqrt(n). Measured, for 20 to 2000 rows."""


class Interval(NamedTuple):
    """Mean by likelihood, and the interval of 95 % confidence."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Identified:
    """What a log tells. parameters: mu_static, mu_kinetic [-], others asked for in Belief's units.

    slipped: False without a slip in the log: then mu_static's value and upper end are infinite, its
    lower end is what the foot held, and mu_kinetic is NaN. explained: whether the noises explain
    the angles. noise: of an angle [rad]. disturbance: of the torque, all that the model leaves out
    [N m]. means [n, 8], innovations and deviations [n] [rad]: the filter's, as in Belief.
    """

    parameters: Mapping[str, Interval]
    slipped: bool
    explained: bool
    noise: float
    disturbance: float
    means: Float[np.ndarray, "n 8"]
    innovations: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class WalkLog:
    """times [n] [s], torques [n] until the next [N m], crank angles [n] [rad], turns counted."""

    times: Float[np.ndarray, " n"]
    torques: Float[np.ndarray, " n"]
    angles: Float[np.ndarray, " n"]

    def __post_init__(self):
        for name in ("times", "torques", "angles"):
            value = np.array(getattr(self, name), float)
            checks.require_number(name, value, low=-np.inf, accepted="finite numbers")
            if value.ndim != 1 or len(value) < LEAST_ROWS or len(value) != len(self.times):
                accepted = f"one row of {LEAST_ROWS} numbers or more, as many as times"
                raise ValueError(f"{name} has shape {value.shape}; accepted: {accepted}")
            settle(self, **{name: read_only(value)})
        checks.require_increasing("times", self.times, "increasing times [s]")
        turned = np.abs(np.abs(np.diff(self.angles)) - 2 * np.pi) < 1.0
        if np.any(turned & (np.diff(self.times) < 0.1)):  # 50 rad/s
            raise ValueError("angles jump by a turn; accepted: ones without jumps (numpy.unwrap)")

    @property
    def noise(self) -> float:
        """Deviation of an angle [rad]: the median of third divided differences, each over its own
        deviation under unit noise, so that a few wrong angles do not count. Gaps are left out."""
        times, angles = (sliding_window_view(one, 4) for one in (self.times, self.angles))
        weights = 1 / np.prod(times[:, :, None] - times[:, None] + np.eye(4), axis=-1)
        third = np.abs(np.sum(weights * angles, 1)) / np.linalg.norm(weights, axis=1)
        even = np.max(np.diff(times), axis=1) <= GAP * np.median(np.diff(self.times))
        median = np.median(third[even] if np.any(even) else third)
        return float(median / 0.6745)  # which is that of a normal distribution of deviation 1

    @classmethod
    def from_file(cls, path: Path | str) -> WalkLog:
        """Read a table of time, torque and crank angle, see `read_columns`."""
        return cls(*read_columns(Path(path), COLUMNS).T)


def identify(
    params: BipedParams,
    log: WalkLog,
    unknown: Iterable[str] = ("payload",),
    *,
    noise: float | None = None,
    seed: int = 0,
    progress: bool = False,
) -> Identified:
    """Estimate static and kinetic friction, and numbers of UNKNOWNS, from the log of a walk.

    params: the robot, to which a payload is added. unknown: names of UNKNOWNS; the others are as
    UNKNOWNS says before a walk. noise: of the encoder [rad], by default what third differences of
    the angles show, 1e-4 at least, or what the fit leaves where that is more: see SCATTER.

    A Kalman filter (`observe`) for each of many frictions gives the likelihood of the angles. New
    frictions are drawn about the best ones, round by round, while the noise of the torque that the
    filter assumes is halved; the greatest likelihood of all says which noise it was. Intervals:
    frictions of a likelihood ratio up to chi^2 of 95 % in two dimensions, and over these the
    filters' own intervals. The log shows slip where Bayes' information criterion prefers it. Double
    precision. The walk begins with the foot at rest. Neglected: patches of other friction.
    """
    checks.require_kind("params", params, BipedParams, "a BipedParams")
    checks.require_kind("log", log, WalkLog, "a WalkLog")
    asked = tuple(dict.fromkeys(unknown))
    for name in asked:
        checks.require_choice("unknown", name, tuple(UNKNOWNS))
    rule: dict[str, Any] = {"low": 0.0, "strict": True, "accepted": "a finite number > 0 [rad]"}
    checks.require_number("noise", LEAST_NOISE if noise is None else noise, **rule)
    with precision("float64"), Bar("identify", None, "round", progress) as bar:
        search = _Search(params, log, asked, noise, seed)
        return search.identified(*search.search(bar))


class _Tried(NamedTuple):
    """Frictions that were tried, by falling likelihood: points [m, 2], the logarithms of
    static and kinetic friction, and the filters' beliefs at the log's end."""

    points: np.ndarray
    last: Belief

    def take(self, rows: Any) -> _Tried:
        return jax.tree.map(lambda leaf: leaf[rows], self)

    def within(self, most: float) -> _Tried:
        """Those whose misfit is at most this much above the least."""
        return self.take(self.last.misfit <= self.last.misfit[0] + most)

    @property
    def unknowns(self) -> tuple[np.ndarray, np.ndarray]:
        """Means and deviations of the unknowns [m, 5]."""
        variance = np.diagonal(self.last.covariance, axis1=1, axis2=2)[:, 3:]
        return np.asarray(self.last.mean[:, 3:]), np.sqrt(np.maximum(variance, 0.0))


class _Search:
    """The search of `identify`. means, spread: of the unknowns before the walk. rows: the filter's
    rows at whose end an angle was read."""

    def __init__(self, params, log: WalkLog, asked: tuple[str, ...], noise, seed: int):
        most = max(FIT, math.exp(SCATTER / math.sqrt(len(log.times))))
        noise, self.most = (max(log.noise, LEAST_NOISE), most) if noise is None else (noise, 1.0)
        model = prepare(params.astype("float64"), fidelity="table")
        self.robot = model, model.unit_inertia()
        held, durations = log.torques[:-1], np.diff(log.times)
        # Before a log the torque is taken to be the first.
        impulse = np.concatenate([[-held[0], 0.0], np.cumsum(held * durations)])
        # A longer row than the usual ones is predicted in parts; no angle was read between them.
        substeps = math.ceil(float(np.median(durations)) / LONGEST_STEP * (1 - 1e-6))
        parts = np.ceil(durations / (substeps * LONGEST_STEP) * (1 - 1e-6)).astype(int)
        checks.require_memory("the log's gaps", "parts of rows", float(np.sum(parts)), ROW)
        self.rows = np.cumsum(parts) - 1
        durations, held = (np.repeat(one, parts) for one in (durations / parts, held))
        angles = np.full(len(held), np.nan)
        angles[self.rows] = log.angles[1:]
        begins = log.times[0] + np.append(0.0, np.cumsum(durations)[:-1])
        rows = begins, begins + durations, held, durations, angles
        self.log = (np.append(log.times[0] - 1.0, log.times), impulse), rows
        self.static = tuple(name for name in LOADS if name in asked), RK4Split(substeps=substeps)
        few = slice(0, LEAST_ROWS // 2)
        begun = log.times[few] - log.times[0]
        fits = [np.polyfit(begun, log.angles[few], degree)[:-3:-1] for degree in (2, 3)]
        usual = np.array([3 * noise, START + 6 * noise / begun[-1]])
        self.began = *fits[0], usual + np.abs(fits[1] - fits[0])
        self.asked, self.noise, self.random = asked, noise, np.random.default_rng(seed)
        self.means, prior = np.array(list(UNKNOWNS.values())).T
        self.prior = self.spread = prior * [name in asked for name in UNKNOWNS]

    def filtered(self, points, disturbance: float, means=None, history: bool = False) -> Belief:
        """Beliefs at the log's end under each friction, or with history at every row. means: of the
        unknowns for each, [m, 5]."""
        means = np.broadcast_to(self.means if means is None else means, (len(points), 5))
        size, parts = 1 if history else MEMBERS, []
        for first in range(0, len(points), size):  # of one size: one program
            begun = (*self.began, padded(means, size, first), self.spread)
            floor = Uniform(*np.exp(padded(points, size, first).T))
            given = floor, begun, Noise(self.noise, disturbance)
            parts.append(_bank(*self.static, history, self.robot, self.log, *given))
        return jax.tree.map(lambda *leaves: np.concatenate(leaves)[: len(points)], *parts)

    def tried(self, points, disturbance: float, means=None) -> _Tried:
        last = self.filtered(points, disturbance, means)
        last = last._replace(misfit=np.nan_to_num(last.misfit, nan=np.inf))
        return _Tried(points, last).take(np.argsort(last.misfit, kind="stable"))

    def search(self, bar: Bar) -> tuple[np.ndarray, np.ndarray, float]:
        """The best frictions, their covariance, and the disturbance of the greatest likelihood.

        Begun at one disturbance after another until it ends at the smallest.
        """
        start, stages, self.bar = (self.means, self.spread), [], bar
        for first in FIRST:
            if stages and min(stages, key=MISFIT)[2][2] == DISTURBANCES[-1]:
                break
            self.means, self.spread = start
            stages += self.stages(first, bar)
        _, (self.means, self.spread), found = min(stages, key=MISFIT)
        return found

    def stages(self, first: int, bar: Bar) -> list[tuple[float, Any, Any]]:
        """Least misfit of each stage, what was taken for the unknowns, and the result."""
        (low, high), ratios = np.log(FRICTION), np.log(np.linspace(*RATIO, GRID[1]))
        points = [(one, one + ratio) for one in np.linspace(low, high, GRID[0]) for ratio in ratios]
        tried, C, stages = self.tried(np.array(points), DISTURBANCES[first]), None, []
        for disturbance in DISTURBANCES[first:]:
            known = self.means, self.spread
            for _ in range(ROUNDS):
                centre, C = self.focus(tried.take(slice(BEST)), C)
                known = self.means, self.spread
                drawn = self.random.multivariate_normal(centre, C, MEMBERS - 1)
                points = np.concatenate([tried.points[:1], within_range(drawn)])
                tried = self.tried(points, disturbance)
                bar.advance()
            least = float(tried.last.misfit[0])
            if stages and least > min(stages, key=MISFIT)[0] + HOPELESS:
                break
            stages.append((least, known, (tried.points[0], C, float(disturbance))))
        return stages

    def focus(self, best: _Tried, before: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of the best frictions; the unknowns' means follow them, too."""
        weights = np.log(len(best.points) + 0.5) - np.log(np.arange(len(best.points)) + 1)
        weights /= weights.sum()
        centre = weights @ best.points
        off = best.points - centre
        C = WIDER * (off.T * weights) @ off
        means, deviations = best.unknowns
        self.means = weights @ means
        apart = np.sqrt(weights @ (means - self.means) ** 2)
        self.spread = np.minimum(self.prior, PRIOR * np.hypot(deviations[0], apart))
        return centre, (C if before is None else (C + before) / 2) + NARROW**2 * np.eye(2)

    def identified(self, best: np.ndarray, C: np.ndarray, disturbance: float) -> Identified:
        """Intervals about the best frictions, or above the least where the log shows no slip."""
        left = 1 - (2 + len(self.asked)) / len(self.rows)  # degrees of freedom in a row
        square = self.walk(best[None], self.means[None], disturbance)[1] / left
        raised = min(max(1.0, square), self.most)
        self.noise *= math.sqrt(raised)
        points = np.stack([best, np.log([GRIP, GRIP])])
        both = _Tried(points, self.filtered(points, disturbance))
        last, gripping = both.take([0]), both.take([1])
        self.spread = np.minimum(self.prior, FREE * last.unknowns[1][0])
        evidence = gripping.last.misfit[0] - last.last.misfit[0]
        slipped = bool(evidence > 2 * np.log(len(self.rows)))
        near, even = self.region(best, C, disturbance) if slipped else (gripping, gripping)
        weights = np.exp((near.last.misfit[0] - even.last.misfit) / 2)
        weights /= weights.sum()
        if slipped:
            ends = weights @ even.points, near.points.min(axis=0), near.points.max(axis=0)
            frictions = [Interval(*map(float, one)) for one in np.exp(ends).T]
        else:
            held = self.held(float(gripping.last.misfit[0]) + JOINT, disturbance)
            frictions = [Interval(np.inf, held, np.inf), Interval(np.nan, np.nan, np.nan)]
        means, deviations = near.unknowns
        ends = (means - SIGMAS * deviations).min(axis=0), (means + SIGMAS * deviations).max(axis=0)
        parameters: dict[str, Interval] = {"mu_static": frictions[0], "mu_kinetic": frictions[1]}
        for name, *found in zip(UNKNOWNS, weights @ even.unknowns[0], *ends, strict=True):
            if name in self.asked:
                parameters[name] = Interval(*map(float, found))
        walk, square = self.walk(near.points[:1], means[:1], disturbance)
        told = slipped, square * raised <= max(FIT, self.most), self.noise, float(disturbance)
        return Identified(parameters, *told, walk.mean, walk.innovation, walk.deviation)

    def walk(self, points, means, disturbance: float) -> tuple[Any, float]:
        """Belief at every row; mean square of relative innovations, NaN of a lost filter."""
        every = self.filtered(points, disturbance, means, history=True)
        walk = jax.tree.map(lambda one: one[0, self.rows], every)
        with np.errstate(invalid="ignore"):
            return walk, float(np.mean((walk.innovation / walk.deviation) ** 2))

    def region(self, best: np.ndarray, C: np.ndarray, disturbance: float) -> tuple[_Tried, _Tried]:
        """Frictions of the region of JOINT, and those of the last rounds, which are even in it:
        rounds go on until it grows no more. C: covariance of the first ones."""
        drawn = np.vstack([best, self.random.multivariate_normal(best, 9 * C, LAST - 1)])
        grew, even, tried = 0, [], self.tried(within_range(drawn), disturbance)
        tried = self.tried(tried.points, disturbance, tried.last.mean[:, 3:])
        for number in range(MOST_ROUNDS):
            near, turn = tried.within(JOINT), 2 * np.pi * self.random.random(LAST)
            axes = np.linalg.cholesky(np.cov(near.points.T, bias=True) + NARROW**2 * np.eye(2))
            known = np.linalg.solve(axes, (near.points - near.points.mean(axis=0)).T)
            reach = np.where(np.arange(LAST) % 4, *REACH) * np.sqrt(self.random.random(LAST))
            far = max(1.0, np.max(np.hypot(*known))) * reach
            drawn = far * np.stack([np.cos(turn), np.sin(turn)])
            nearest = np.argmin(np.hypot(*(drawn[:, :, None] - known[:, None])), axis=1)
            new = within_range(near.points.mean(axis=0) + (axes @ drawn).T)
            new = self.tried(new, disturbance, near.last.mean[nearest, 3:])
            tried = jax.tree.map(lambda *both: np.concatenate(both), tried, new)
            even = [*even, new][-PATIENCE:]
            self.bar.advance()
            tried = tried.take(np.argsort(tried.last.misfit, kind="stable"))
            was, size = (np.ptp(one.points, axis=0) for one in (near, tried.within(JOINT)))
            grew = number if np.any(size > (1 + GROWTH) * was) else grew
            if number - grew >= PATIENCE:
                break
        even = jax.tree.map(lambda *all: np.concatenate(all), tried.take([0]), *even)
        return tried.within(JOINT), even.within(JOINT)

    def held(self, most: float, disturbance: float) -> float:
        """Least friction of a misfit up to `most`, of a log that shows no slip."""
        low, high = np.log(FRICTION)
        for _ in range(2):
            logs = np.linspace(low, high, MEMBERS)
            misfit = self.filtered(np.stack([logs, logs], -1), disturbance).misfit
            first = int(np.max(np.flatnonzero(~(misfit <= most)), initial=-1)) + 1
            low, high = logs[max(first - 1, 0)], logs[min(first, MEMBERS - 1)]
        return float(np.exp(high))


def within_range(points: np.ndarray) -> np.ndarray:
    """Log frictions in the ranges that are searched."""
    static = np.clip(points[:, 0], *np.log(FRICTION))
    low, high = static + np.log(RATIO)[:, None]
    return np.stack([static, np.clip(points[:, 1], low, high)], -1)


@partial(jax.jit, static_argnums=(0, 1, 2))
def _bank(loads, integrator, history, robot, log, friction, begun, noise) -> Belief:
    """One filter a friction, over all rows of a log: the last beliefs, or those of every row.

    log: times and torque integrated so far; begin, end, torque, duration, next angle of each row.
    """
    impulse, rows = log
    angle, rate, deviations, means, spread = begun

    def one(friction, means):
        def body(belief, row):
            begin, end, torque, duration, read = row

            def mean_torque(delay):
                ends = jnp.interp(jnp.stack([begin, end]) - delay, *impulse)
                return (ends[1] - ends[0]) / duration

            held = mean_torque if "encoder_delay" in loads else torque
            given = robot, friction, belief, held, duration, read, noise
            belief = observe(*given, loads=loads, integrator=integrator)
            return belief, belief if history else None

        start = initial_belief(angle, rate, deviations, means, spread)
        last, every = jax.lax.scan(body, start, rows)
        return every if every is not None else last

    return jax.vmap(one)(friction, means)
