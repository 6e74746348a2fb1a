"""Cells of leg angles: where they are cut, what is proved of them: values, derivatives, exclusion.

Take a leg at a in a cell I and, a waypoint later, at b in a cell J, with |b - a| <= what the rate
allows. Where that is a whole number of cells, the allowed (a, b) are squares I x J and triangles,
halves of squares cut along the diagonal b - a = limit, whose corners are allowed moves. So a
function that lies above its interpolant of these (less something known) is bounded there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import jax
import numpy as np

from stickslip.optim.intervals import Interval, Jet, interval
from stickslip.optim.posture.bounds.ground import Arc, Ground, ground_of
from stickslip.optim.posture.bounds.vehicle import (
    Bracket,
    angle_jets,
    held,
    rear_jets,
    weight_of,
    wheel_at,
    wheelbase_squared,
)
from stickslip.optim.posture.waypoints import PostureData, longest_wheelbase
from stickslip.optim.problem import FEASIBLE

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.optim.posture.problem import PostureProblem


NONE, SQUARE, AHEAD, BACK = range(4)
FINE = 4e-3
"""A box is cut until what its second derivatives take off its corners' interpolant, or its first
ones, is less than this part of the field's range, or until there were CUTS turns."""
CUTS = 2
WORST = 0.6
"""Parts that lose more than this share of what the worst part of their box does are cut."""
PARTS = 16
"""Greatest average number of parts of a box, with ROOM besides, beyond which none is cut."""
ROOM = 2_000
FLOOR = 1e-3
"""Least range of a field, in its unit."""
MOST_CELLS = 256
"""Most cells of a leg at the first level, beyond which cells are no part of the rate."""


Axis: TypeAlias = np.ndarray
"""A leg's corners at a waypoint [n] [rad], increasing; two for a given angle, all but the same."""


def halved(axis: Axis) -> Axis:
    """The corners, and one in the middle of each cell."""
    return np.sort(np.concatenate([axis, axis[:-1] + np.diff(axis) / 2]))


def first_axis(problem: PostureData, leg: int, cells: int) -> Axis:
    """About so many cells of a leg over its range, a whole part of what the rate allows."""
    low = float(problem.params.leg_angle_min) - FEASIBLE
    high = float(problem.params.leg_angle_max) + FEASIBLE
    even = np.linspace(low, high, cells + 1)
    limit = float(np.min(problem.longest_moves)) * (1 + FEASIBLE) * (1 + FEASIBLE)
    if limit > high - low or limit < (high - low) / MOST_CELLS:
        return even
    step = limit / np.ceil(limit * cells / (high - low))
    given = [of for of in (problem.start_angles, problem.end_angles) if of is not None]
    anchor = float(given[0][leg]) if given else (low + high) / 2
    first, last = np.ceil((low - anchor) / step), np.floor((high - anchor) / step)
    inner = anchor + step * np.arange(first, last + 1)
    inner = inner[(inner > low + 1e-6 * step) & (inner < high - 1e-6 * step)]
    return np.concatenate([[low], inner, [high]])


def shapes(problem: PostureData, step: int, a: Axis, b: Axis) -> Int[np.ndarray, "n-1 m-1"]:
    """Shape of the allowed moves of each pair of cells, before and after a step: NONE are, all
    of the SQUARE, or the triangle without the longest move AHEAD, or BACK."""
    limit = float(problem.longest_moves[step]) * (1 + FEASIBLE)  # of a feasible drive
    ahead, ahead_half = _one_way(a, b, limit)
    back, back_half = (of[::-1, ::-1] for of in _one_way(-a[::-1], -b[::-1], limit))
    square = (ahead & back) | (ahead_half & back_half)  # cut at both sides: taken whole
    return np.select([square, ahead_half & back, back_half & ahead], [SQUARE, AHEAD, BACK], NONE)


def _one_way(a: np.ndarray, b: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Masks of pairs of cells: where some b - a < limit in more than, and where in
    no more than the half below its diagonal."""
    a0, a1, b0, b1 = a[:-1, None], a[1:, None], b[:-1], b[1:]
    some = b0 - a1 < limit
    half = some & (b0 - a0 >= limit) & (b1 - a1 >= limit)
    return some & ~half, half


def bulge(
    h: np.ndarray, slope: np.ndarray, bend: np.ndarray, smooth: Bool[np.ndarray, "..."]
) -> np.ndarray:
    """Greatest distance of a field from its interpolant along a leg's cell of width h: h^2 / 8 of
    the second derivative where it is smooth, or h / 2 of the first, whichever is less."""
    curved, straight = h**2 / 8 * bend, h / 2 * slope
    return np.where(smooth, np.minimum(curved, straight), straight)


class Boxes(NamedTuple):
    """Derivatives of fields over each of n boxes of leg angles; anything where unknown.

    lo, hi: ends [fields, 2, 2, n], of the first and the second derivative along rear and front.
    """

    names: tuple[str, ...]
    lo: Float[np.ndarray, "fields 2 2 n"]
    hi: Float[np.ndarray, "fields 2 2 n"]
    known: Bool[np.ndarray, "n"]
    """False: of postures in the box nothing is known."""
    smooth: Bool[np.ndarray, "n"]
    """False: the second derivatives are none."""

    def derivative(self, name: str, order: int) -> Interval:
        """The first or the second derivative of a field [2, n]."""
        at = self.names.index(name), order - 1
        return Interval(self.lo[at], self.hi[at])


def by_parts(of: Callable[[Interval], tuple[Boxes, np.ndarray]], whole: Interval) -> Boxes:
    """Hull over whole boxes [2, n] of their parts, each cut in four until it is narrow enough.

    of: boxes of angles, and about what each field is there, but for a constant [fields, n].
    """
    boxes, middle = of(whole)
    count, widths = boxes.known.size, whole.hi - whole.lo
    scales = np.full(len(middle), FLOOR)
    if np.any(boxes.known):
        scales = np.maximum(np.ptp(middle[:, boxes.known], axis=1), FLOOR)
    cuts, owner, lost = whole, np.arange(count), _lost(boxes, widths, scales)
    for _ in range(CUTS):
        worst = np.zeros(count)
        np.maximum.at(worst, owner, lost)
        poor = (lost > FINE) & (lost >= WORST * worst[owner])
        if not np.any(poor) or owner.size + 3 * np.sum(poor) > PARTS * count + ROOM:
            break
        parts, theirs = _quarters(cuts[:, poor]), np.tile(owner[poor], 4)
        found, _ = of(parts)
        pairs = zip(boxes[1:], found[1:], strict=True)
        boxes = Boxes(boxes.names, *(_after(one, poor, other) for one, other in pairs))
        lost = _after(lost, poor, _lost(found, widths[:, theirs], scales))
        cuts = Interval(_after(cuts.lo, poor, parts.lo), _after(cuts.hi, poor, parts.hi))
        owner = _after(owner, poor, theirs)
    order = np.argsort(owner, kind="stable")
    begin = np.searchsorted(owner[order], np.arange(count))
    joins = zip((np.minimum, np.maximum, np.logical_and, np.logical_and), boxes[1:], strict=True)
    hulls = (join.reduceat(of[..., order], begin, -1) for join, of in joins)
    return Boxes(boxes.names, *hulls)


def _after(one: np.ndarray, poor: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Entries that are not cut, then those of the parts."""
    return np.concatenate([one[..., ~poor], other], -1)


def _lost(boxes: Boxes, widths: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Greatest loss in each part, in ranges of the field; infinite where nothing is known.
    widths: of the boxes that they are parts of [2, n]."""
    size = np.maximum(np.abs(boxes.lo), np.abs(boxes.hi))
    lost = bulge(widths, size[:, 0], size[:, 1], boxes.smooth)
    return np.where(boxes.known, np.max(np.max(lost, 1) / scales[:, None], 0), np.inf)


def _quarters(boxes: Interval) -> Interval:
    """Boxes [2, n] cut in four [2, 4 n]."""
    middle = boxes.lo + (boxes.hi - boxes.lo) / 2
    ends = []
    for low, high in ((boxes.lo, middle), (middle, boxes.hi)):
        pairs = [(rear, front) for rear in (low, high) for front in (low, high)]
        ends.append(np.concatenate([np.stack([r[0], f[1]]) for r, f in pairs], -1))
    return Interval(*ends)


FIELDS = ("torque", "turn", "leg_rear", "leg_front", "F", "N_rear", "N_front")


@dataclass(frozen=True)
class StationCells:
    """One waypoint's cells; rear and front: their corners.

    alive: cells that a good drive may pass. values: of the fields at the corners [R, F], 0 at those
    of no such cell; radii: by how much any of them may be off.
    """

    bracket: Bracket
    own_turn: Interval
    """Turn of the front wheel that does not depend on the legs [rad]."""
    rear: Axis
    front: Axis
    alive: Bool[np.ndarray, "R-1 F-1"]
    values: dict[str, Float[np.ndarray, "R F"]]
    radii: dict[str, float]
    inside: Boxes
    """Derivatives over each cell [..., R-1, F-1]; 0 where unknown."""
    friction: tuple[Float[np.ndarray, "R-1 F-1"], float] = (np.zeros((0, 0)), 0.0)
    """Greatest mu of the rear wheel in each cell, and of the front one."""

    @property
    def wheels(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Fields of the forces along and across the ground, of the rear and the front wheel."""
        front = "F_front" if "F_front" in self.inside.names else "F"
        return ("F", "N_rear"), (front, "N_front")

    @property
    def box(self) -> tuple[slice, slice]:
        """The least rectangle that holds the cells that are alive, one of them at least."""
        rows, columns = np.nonzero(self.alive)
        if not len(rows):
            return slice(0, 1), slice(0, 1)
        return slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)

    @property
    def boxed(self) -> tuple[Axis, Axis]:
        """Corners of the box."""
        rear, front = self.box
        return self.rear[rear.start : rear.stop + 1], self.front[front.start : front.stop + 1]

    def bulge(self, name: str, sign: int) -> np.ndarray:
        """Greatest distance of sign * field below its values at the corners of a cell."""
        total = np.zeros(self.alive.shape)
        first, second = (self.inside.derivative(name, order) for order in (1, 2))
        for leg, h in enumerate((np.diff(self.rear)[:, None], np.diff(self.front))):
            bend = np.maximum(second[leg].hi if sign > 0 else -second[leg].lo, 0)
            total += bulge(h, first[leg].size, bend, self.inside.smooth)
        return np.where(self.inside.known, total * (1 + 1e-9) + self.radii[name], np.inf)

    def at_least(self, name: str, sign: int) -> np.ndarray:
        return of_corners(sign * self.values[name], np.minimum) - self.bulge(name, sign)

    def grip_at_most(self, wheel: int, sign: int) -> np.ndarray:
        """Upper bound of mu N - sign F in each cell, by their common corners; wheel: see wheels."""
        (F, N), mu = self.wheels[wheel], self.friction[wheel]
        corners = [
            mu * n - sign * f
            for n, f in zip(corners_of(self.values[N]), corners_of(self.values[F]), strict=True)
        ]
        return np.max(corners, 0) + self.bulge(F, sign) + mu * self.bulge(N, -1)

    def range_of(self, name: str) -> Interval:
        return Interval(self.at_least(name, 1), -self.at_least(name, -1))


def corners_of(values: np.ndarray) -> list[np.ndarray]:
    """Values at each cell's four corners, one after the other."""
    return [of for rows in (values[:-1], values[1:]) for of in (rows[:, :-1], rows[:, 1:])]


def of_corners(values: np.ndarray, reduce: np.ufunc) -> np.ndarray:
    """Reduction over each cell's four corners."""
    return reduce.reduce(corners_of(values))


class Surveyor:
    """Makes and refines the cells of a problem's waypoints; kept: the fields that are asked for."""

    def __init__(self, problem: PostureProblem, kept: tuple[str, ...] = FIELDS):
        self.problem, self.kept = problem, kept
        rolls = problem.params.rolling_resistance is not None
        self.fields = (*FIELDS, "F_front") if rolls else FIELDS
        always = {"F", "N_rear", "N_front", *self.fields[len(FIELDS) :]}
        self.inside = tuple(sorted({*kept, *always} & {*self.fields}))
        self.vehicle = jax.tree.map(lambda leaf: float(np.asarray(leaf)), problem.params)
        self.ground: Ground = ground_of(problem.track.shape)
        self.longest = longest_wheelbase(problem.params) * (1 + 1e-3)
        reach = 1.01 * (self.longest + 2 * self.vehicle.wheel_radius)
        first, last = float(problem.x[0]), float(problem.x[-1])
        self.arc = Arc.along(self.ground, first - reach, last + 0.01)
        self.friction = np.broadcast_to(np.asarray(problem.friction, float), problem.x.shape)
        self.least = 0.0
        if not problem.solver.overlap:
            self.least = 2 * self.vehicle.wheel_radius + float(problem.params.wheel_gap)
            self.least += problem.min_wheel_clearance - 2 * FEASIBLE * self.vehicle.leg_length

    def first(self, k: int, rear: Axis, front: Axis) -> StationCells:
        r, x = self.vehicle.wheel_radius, float(self.problem.x[k])
        bracket = Bracket.behind(self.ground, r, x, self.longest)
        alive = np.ones((len(rear) - 1, len(front) - 1), bool)
        alive, inside = self._inside(bracket, rear, front, alive)
        rolled = self.arc.at(interval(self.problem.x[k : k + 1]))[0]
        own = bracket.front.slope.arctan() - rolled / r
        return self._valued(k, StationCells(bracket, own, rear, front, alive, {}, {}, inside))

    def halved(self, k: int, cells: StationCells) -> StationCells:
        """Every cell cut in four (a given angle's is not), without those beside all alive."""
        rear, front = (of if of[-1] - of[0] <= 3 * FEASIBLE else halved(of) for of in cells.boxed)
        alive = cells.alive[cells.box]
        for axis, of in ((0, rear), (1, front)):
            alive = np.repeat(alive, (len(of) - 1) // alive.shape[axis], axis)
        alive, inside = self._inside(cells.bracket, rear, front, alive)
        return self._valued(k, replace(cells, rear=rear, front=front, alive=alive, inside=inside))

    def _inside(
        self, bracket: Bracket, rear: Axis, front: Axis, alive: np.ndarray
    ) -> tuple[np.ndarray, Boxes]:
        """The cells in some posture of which the wheels may clear each other, and derivatives."""
        alive[alive] = self._wheelbases(_boxes(rear, front, alive)).value.hi >= self.least**2
        if not np.any(alive):
            none = np.zeros((len(self.inside), 2, 2, *alive.shape))
            return alive, Boxes(self.inside, none, none, alive.copy(), alive.copy())
        found = by_parts(lambda angles: self._over(bracket, angles), _boxes(rear, front, alive))

        def spread(of: np.ndarray) -> np.ndarray:
            cells = np.zeros((*of.shape[:-1], *alive.shape), of.dtype)
            cells[..., alive] = np.where(found.known, of, of.dtype.type(0))
            return cells

        return alive, Boxes(found.names, *map(spread, found[1:]))

    def _over(self, bracket: Bracket, angles: Interval) -> tuple[Boxes, np.ndarray]:
        """Boxes of angles [2, n], each as a whole, and the middle of each field there."""
        rear_jet, front_jet = angle_jets(angles)
        Q = self._wheelbases(angles)
        x, known, (first, last) = bracket.where(Q.value)
        with np.errstate(all="ignore"):
            behind = rear_jets(bracket, Q, first, last)
            found = held(self.vehicle, rear_jet, front_jet, Q, behind, bracket.front)
        jets = [found[name] for name in self.inside]
        lo, hi = (
            np.stack([[getattr(of, end) for of in (jet.first, jet.second)] for jet in jets])
            for end in ("lo", "hi")
        )
        known &= np.all(np.isfinite(lo) & np.isfinite(hi), axis=(0, 1, 2))
        bends = np.sort(self.ground.bends)
        smooth = np.searchsorted(bends, x.lo, "left") == np.searchsorted(bends, x.hi, "right")
        middle = np.stack([jet.value.middle for jet in jets])
        return Boxes(self.inside, lo, hi, known, smooth), middle

    def _wheelbases(self, angles: Interval) -> Jet:
        """The squared wheelbase over boxes of angles [2, n], its range also by the slopes."""
        Q = wheelbase_squared(self.vehicle, *angle_jets(angles))
        middle = interval(angles.middle)
        about = wheelbase_squared(self.vehicle, middle[0], middle[1])
        for leg in (0, 1):
            about = about + Q.first[leg] * (angles[leg] - middle[leg])
        value = Interval(np.maximum(Q.value.lo, about.lo), np.minimum(Q.value.hi, about.hi))
        return replace(Q, value=value)

    def _valued(self, k: int, cells: StationCells) -> StationCells:
        """Cells with values at the corners, without those in which every posture is excluded."""
        wanted = of_corners(np.pad(cells.alive, 1), np.logical_or)
        rows, columns = np.nonzero(wanted)
        r, f = interval(cells.rear[rows]), interval(cells.front[columns])
        Q = wheelbase_squared(self.vehicle, r, f)
        x, good = cells.bracket.contact(Q)
        wheel = wheel_at(self.ground, self.vehicle.wheel_radius, x, cells.bracket.origin)
        with np.errstate(all="ignore"):
            rear = x - cells.bracket.origin[0], wheel.height, wheel.slope, self.arc.at(x)
            found = held(self.vehicle, r, f, Q, rear, cells.bracket.front)
            found["turn"] += cells.own_turn
            good &= np.all([np.isfinite(found[name].size) for name in self.fields], axis=0)
            values, radii = {name: np.zeros(wanted.shape) for name in self.fields}, {}
            for name, grid in values.items():
                grid[rows, columns] = np.where(good, found[name].middle, 0.0)
                radii[name] = float(np.max(np.where(good, found[name].radius, 0.0), initial=0.0))
        unknown = np.zeros(wanted.shape, bool)
        unknown[rows, columns] = ~good
        lost = of_corners(unknown, np.logical_or)
        if np.any(lost):  # a corner without a value: nothing is known of the cells about it
            cells = replace(cells, inside=cells.inside._replace(known=cells.inside.known & ~lost))
        friction = self._friction(k, cells)
        valued = replace(cells, values=values, radii=radii, friction=friction)
        alive = cells.alive & ~self._ruled_out(k, valued)
        values = {name: of for name, of in values.items() if name in self.kept}
        return replace(valued, alive=alive, values=values)

    def _friction(self, k: int, cells: StationCells) -> tuple[np.ndarray, float]:
        x, mu, surface = self.problem.x[k : k + 1], self.friction[k], self.problem.track.surface
        rear = np.full(cells.alive.shape, mu)
        if surface is None:
            return rear, float(mu)
        Q = self._wheelbases(_boxes(cells.rear, cells.front, cells.alive)).value
        behind = cells.bracket.where(Q)[0]
        rear[cells.alive] = surface.mu(mu, surface.most(behind.lo, behind.hi))
        return rear, float(surface.mu(mu, surface.most(x, x))[0])

    def _ruled_out(self, k: int, cells: StationCells) -> np.ndarray:
        """Cells in which a wheel slips or lifts in every posture, by more than is let pass.

        The motors' torque is not looked at, nor what DriveBound leaves out.
        """
        problem = self.problem
        slack = 2 * FEASIBLE * float(weight_of(self.vehicle).hi)
        out = np.zeros(cells.alive.shape, bool)
        known = np.ones(out.shape, bool)
        for wheel, (along, across) in enumerate(cells.wheels):
            F, N, mu = cells.range_of(along), -cells.at_least(across, -1), cells.friction[wheel]
            known &= np.isfinite(F.size)
            out |= float(problem.min_normal) - slack > N
            # mu N - |F| is below this in all of the cell.
            with np.errstate(invalid="ignore"):  # 0 times infinity tells nothing
                for sign in (1, -1):
                    out |= cells.grip_at_most(wheel, sign) < float(problem.min_grip) - slack
                out |= mu * N - F.least_size < float(problem.min_grip) - slack
        return out & known


def _boxes(rear: Axis, front: Axis, alive: np.ndarray) -> Interval:
    """Leg angles of the cells that are alive [2, n] [rad]."""
    rows, columns = np.nonzero(alive)
    return Interval(*(np.stack([rear[rows + k], front[columns + k]]) for k in (0, 1)))
