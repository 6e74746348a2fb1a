"""Proved properties of each waypoint's cells: values at corners, derivatives, excluded cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.optim.intervals import Interval, interval
from stickslip.optim.posture.bounds.ground import Arc, Ground, ground_of
from stickslip.optim.posture.bounds.lattice import Axis, Boxes, by_parts
from stickslip.optim.posture.bounds.vehicle import (
    Bracket,
    Held,
    Rear,
    angle_jets,
    held,
    rear_jets,
    weight_of,
    wheel_at,
    wheelbase_squared,
)
from stickslip.optim.posture.waypoints import longest_wheelbase
from stickslip.optim.problem import FEASIBLE

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.intervals import Jet
    from stickslip.optim.posture.problem import PostureProblem


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

    @property
    def size(self) -> int:
        return int(np.prod([of.stop - of.start for of in self.box]))

    @property
    def box(self) -> tuple[slice, slice]:
        """The least rectangle that holds the cells that are alive, one of them at least."""
        rows, columns = np.nonzero(self.alive)
        if not len(rows):
            return slice(0, 1), slice(0, 1)
        return slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)

    def cropped(self) -> StationCells:
        """The cells of `box`; of what is inside and at the corners nothing is kept."""
        box = self.box
        rear, front = self.rear.part(box[0]), self.front.part(box[1])
        return replace(self, rear=rear, front=front, alive=self.alive[box])

    def bulge(self, name: str, sign: int) -> np.ndarray:
        """Greatest distance of sign * field below its values at the corners of a cell: h^2 / 8 of
        the second derivative, or h / 2 of the first, whichever is less, of each leg."""
        total = np.zeros(self.alive.shape)
        widths = (self.rear.widths[:, None], self.front.widths)
        smooth, known = self.inside.smooth, self.inside.known
        first, second = (self.inside.derivative(name, order) for order in (1, 2))
        for leg, h in enumerate(widths):
            bend, slope = second[leg], first[leg]
            above = bend.hi if sign > 0 else -bend.lo
            curved = h**2 / 8 * np.maximum(above, 0)
            straight = h / 2 * slope.size
            total += np.where(smooth, np.minimum(curved, straight), straight)
        return np.where(known, total * (1 + 1e-9) + self.radii[name], np.inf)

    def at_least(self, name: str, sign: int) -> np.ndarray:
        return of_corners(sign * self.values[name], np.minimum) - self.bulge(name, sign)

    def grip_at_most(self, wheel: str, sign: int, mu: float) -> np.ndarray:
        """Upper bound of mu N - sign F in each cell, by their common corners; wheel: N's name."""
        corners = of_corners(mu * self.values[wheel] - sign * self.values["F"], np.maximum)
        return corners + self.bulge("F", sign) + mu * self.bulge(wheel, -1)

    def range_of(self, name: str) -> Interval:
        return Interval(self.at_least(name, 1), -self.at_least(name, -1))


def of_corners(values: np.ndarray, reduce: np.ufunc) -> np.ndarray:
    """Reduction over each cell's four corners."""
    rows = reduce(values[:-1], values[1:])
    return reduce(rows[:, :-1], rows[:, 1:])


class Surveyor:
    """Makes and refines the cells of a problem's waypoints; kept: the fields that are asked for."""

    def __init__(self, problem: PostureProblem, kept: tuple[str, ...] = FIELDS):
        self.problem, self.kept = problem, kept
        self.inside = tuple(sorted({*kept, "F", "N_rear", "N_front"}))
        self.vehicle = jax.tree.map(lambda leaf: float(np.asarray(leaf)), problem.params)
        self.ground: Ground = ground_of(problem.track.shape)
        self.longest = longest_wheelbase(problem.params) * (1 + 1e-3)
        reach = 1.01 * (self.longest + 2 * self.vehicle.wheel_radius)
        first, last = float(problem.x[0]), float(problem.x[-1])
        self.arc = Arc.along(self.ground, first - reach, last + 0.01)
        self.friction = most_friction(problem)
        self.least = 0.0
        if not problem.solver.overlap:
            self.least = 2 * self.vehicle.wheel_radius + float(problem.params.wheel_gap)
            self.least += problem.min_wheel_clearance - 2 * FEASIBLE * self.vehicle.leg_length

    def first(self, k: int, rear: Axis, front: Axis) -> StationCells:
        bracket = Bracket.behind(
            self.ground, self.vehicle.wheel_radius, float(self.problem.x[k]), self.longest
        )
        alive = np.ones((len(rear.nodes) - 1, len(front.nodes) - 1), bool)
        alive = self._wheels_clear(rear, front, alive)
        inside = self._inside(bracket, rear, front, alive)
        rolled = self.arc.at(interval(self.problem.x[k : k + 1]))[0]
        own = bracket.front.slope.arctan() - rolled / self.vehicle.wheel_radius
        return self._valued(k, StationCells(bracket, own, rear, front, alive, {}, {}, inside))

    def halved(self, k: int, cells: StationCells) -> StationCells:
        """Every cell cut in four (a given angle's is not), without those beside all alive."""
        cells = cells.cropped()
        rear, front = (
            axis if axis.nodes[-1] - axis.nodes[0] <= 3 * FEASIBLE else axis.halved()
            for axis in (cells.rear, cells.front)
        )
        alive = cells.alive
        for axis, of in ((0, rear), (1, front)):
            alive = np.repeat(alive, (len(of.nodes) - 1) // alive.shape[axis], axis)
        alive = self._wheels_clear(rear, front, alive)
        inside = self._inside(cells.bracket, rear, front, alive)
        after = replace(cells, rear=rear, front=front, alive=alive, inside=inside)
        return self._valued(k, after)

    def _wheels_clear(self, rear: Axis, front: Axis, alive: np.ndarray) -> np.ndarray:
        """The cells in some posture of which the wheels may clear each other."""
        clear = np.zeros_like(alive)
        clear[alive] = self._wheelbases(_boxes(rear, front, alive)).value.hi >= self.least**2
        return clear

    def _inside(self, bracket: Bracket, rear: Axis, front: Axis, alive: np.ndarray) -> Boxes:
        if not np.any(alive):
            none = np.zeros((len(self.inside), 2, 2, *alive.shape))
            return Boxes(self.inside, none, none, np.zeros_like(alive), np.zeros_like(alive))
        whole = _boxes(rear, front, alive)
        found = by_parts(lambda angles: self._over(bracket, angles), whole)

        def spread(of: np.ndarray) -> np.ndarray:
            cells = np.zeros((*of.shape[:-1], *alive.shape), of.dtype)
            cells[..., alive] = np.where(found.known, of, of.dtype.type(0))
            return cells

        return found.map(spread)

    def _over(self, bracket: Bracket, angles: Interval) -> tuple[Boxes, np.ndarray]:
        """Boxes of angles [2, n], each as a whole, and the middle of each field there."""
        rear_jet, front_jet = angle_jets(angles)
        Q = self._wheelbases(angles)
        x, known, (first, last) = bracket.where(Q.value)
        with np.errstate(all="ignore"):
            behind = rear_jets(bracket, Q, first, last)
            found = held(self.vehicle, rear_jet, front_jet, Q, behind, bracket.front)
        jets = [getattr(found, name) for name in self.inside]
        lo, hi = (
            np.stack(
                [np.stack([getattr(jet.first, end), getattr(jet.second, end)]) for jet in jets]
            )
            for end in ("lo", "hi")
        )
        known &= np.all(np.isfinite(lo) & np.isfinite(hi), axis=(0, 1, 2))
        bends = np.sort(self.ground.bends)
        smooth = np.searchsorted(bends, x.lo, "left") == np.searchsorted(bends, x.hi, "right")
        middle = np.stack([jet.value.middle for jet in jets])
        return Boxes(self.inside, lo, hi, known, smooth), middle

    def _wheelbases(self, angles: Interval) -> Jet:
        """The squared wheelbase over boxes of angles [2, n], its range by the slopes where that
        says more."""
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
        r, f = interval(cells.rear.nodes[rows]), interval(cells.front.nodes[columns])
        Q = wheelbase_squared(self.vehicle, r, f)
        x, good = cells.bracket.contact(Q)
        wheel = wheel_at(self.ground, self.vehicle.wheel_radius, x, cells.bracket.origin)
        with np.errstate(all="ignore"):
            at = Rear(x - cells.bracket.origin[0], wheel.height, wheel.slope, self.arc.at(x))
            found = held(self.vehicle, r, f, Q, at, cells.bracket.front)
            found = replace(found, turn=found.turn + cells.own_turn)
            good &= np.all([np.isfinite(getattr(found, name).size) for name in FIELDS], axis=0)
            values, radii = self._spread(found, good, rows, columns, wanted.shape)
        unknown = np.zeros(wanted.shape, bool)
        unknown[rows, columns] = ~good
        lost = of_corners(unknown, np.logical_or)
        if np.any(lost):  # a corner without a value: nothing is known of the cells about it
            known = cells.inside.known & ~lost
            cells = replace(cells, inside=cells.inside._replace(known=known))
        valued = replace(cells, values=values, radii=radii)
        alive = cells.alive & ~self._ruled_out(k, valued)
        values = {name: of for name, of in values.items() if name in self.kept}
        return replace(valued, alive=alive, values=values)

    def _spread(
        self, found: Held, good: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple
    ) -> tuple[dict[str, np.ndarray], dict[str, float]]:
        values, radii = {}, {}
        for name in FIELDS:
            of: Interval = getattr(found, name)
            grid = np.zeros(shape)
            grid[rows, columns] = np.where(good, of.middle, 0.0)
            values[name] = grid
            radii[name] = float(np.max(np.where(good, of.radius, 0.0), initial=0.0))
        return values, radii

    def _ruled_out(self, k: int, cells: StationCells) -> np.ndarray:
        """Cells in which a wheel slips or lifts in every posture, by more than is let pass.

        The clearance is not looked at, nor the motors' torque, nor whether the ground enters a
        wheel beside its contact; where friction changes along the ground, the most that the rear
        wheel can stand on counts.
        """
        problem = self.problem
        slack = 2 * FEASIBLE * float(weight_of(self.vehicle).hi)
        out = np.zeros(cells.alive.shape, bool)
        F = cells.range_of("F")
        for name, mu in zip(("N_rear", "N_front"), self.friction[k].tolist(), strict=True):
            N = -cells.at_least(name, -1)
            out |= float(problem.min_normal) - slack > N
            # mu N - |F| is below this in all of the cell.
            for sign in (1, -1):
                out |= cells.grip_at_most(name, sign, mu) < float(problem.min_grip) - slack
            out |= mu * N - F.least_size < float(problem.min_grip) - slack
        return out & np.isfinite(F.size)


def _boxes(rear: Axis, front: Axis, alive: np.ndarray) -> Interval:
    """Leg angles of the cells that are alive [2, n] [rad]."""
    rows, columns = np.nonzero(alive)
    ends = (np.stack([rear.nodes[rows + k], front.nodes[columns + k]]) for k in (0, 1))
    return Interval(*ends)


def most_friction(problem: PostureProblem) -> Float[np.ndarray, "K 2"]:
    """mu of the rear and the front wheel at each waypoint, at most.

    The front wheel stands at the waypoint and the rear one within reach behind it. Of the front
    wheel, and of both where the ground has no surface of its own, it is the very mu.
    """
    mu = np.broadcast_to(np.asarray(problem.friction, float), problem.x.shape)[:, None]
    surface = problem.track.surface
    if surface is None:
        return np.repeat(mu, 2, 1)
    reach = 1.01 * (longest_wheelbase(problem.params) + 2 * float(problem.params.wheel_radius))
    behind = surface.most(problem.x - reach, problem.x)
    return mu * np.stack([behind, surface.most(problem.x, problem.x)], -1)
