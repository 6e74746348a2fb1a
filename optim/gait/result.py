"""Result of a gait problem: the gait, its certificates, and the gap that the grid leaves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.result import Result

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.gait.gait import Gait


@dataclass(frozen=True)
class Certificate:
    """Certificate computed in float64 from the robot's numbers, without trust in the solver.

    value: of the gait on the grid. bound: no gait of the grid is better (infinite below: not
    proved). missed: worst violation of a limit at the nodes, in the limit's unit of size. sign: the
    most negative multiplier of a limit (0: none is). complementarity: largest product of a
    multiplier and its limit's slack, over the sum of what the multipliers hold up.
    """

    value: float
    bound: float
    missed: float
    sign: float
    complementarity: float

    @property
    def gap(self) -> float:
        """Value less bound."""
        return self.value - self.bound


@dataclass(frozen=True)
class GaitResult(Result):
    """The outcome of `solve` for a gait problem: see Result; value and bound are those of the grid.

    gait: the best one of the grid, its limits kept at the nodes; between them its crank may stand
    still, and its duration is infinite then. held: a gait whose limits hold between the nodes, too,
    to 1e-8 of their size (1e-7 where the rounds of tightening end before that), as polynomials
    through samples in each cell tell; b > 0 but for rest at the walk's ends, and the mean rate, in
    closed form. held_value is its value, integrated between the nodes; None where none was found.
    every_bound: no gait whatever is better, of any acceleration that may change at any place (None:
    not proved); its integral is a quadrature, whose error is not bounded. So the best possible lies
    between every_bound and held_value, whatever the grid.
    certificate: of the grid's optimum.
    """

    gait: Gait | None = None
    held: Gait | None = None
    held_value: float = np.inf
    every_bound: float | None = None
    certificate: Certificate | None = None

    @property
    def discretisation(self) -> float:
        """(held_value - every_bound) / value: the gap that the grid leaves; infinite if unknown."""
        if self.every_bound is None or not np.isfinite(self.held_value):
            return np.inf
        off = self.held_value - self.every_bound
        return off / max(abs(self.value), np.finfo(float).tiny) if off else 0.0

    @property
    def best(self) -> Gait:
        """`held`, or the grid's own gait where there is none. ValueError without any."""
        found = self.gait if self.held is None else self.held
        if found is None:
            raise ValueError(
                f"the result holds no gait ({self.message}); accepted: one with a gait"
            )
        return found

    @property
    def theta(self) -> Float[np.ndarray, "n K+1"]:
        """Nodes as crank angles of the supporting leg, of `best` as all below [rad]."""
        return self.best.theta

    @property
    def crank_rate(self) -> Float[np.ndarray, "n K+1"]:
        """Crank rate at the nodes [rad/s]."""
        return self.best.crank_rate

    @property
    def torque(self) -> Float[np.ndarray, "n K+1"]:
        """Motor torque at the nodes [N m]."""
        return self.best.torque

    @property
    def mean_rate(self) -> float:
        """Mean crank rate [rad/s]."""
        return self.best.mean_rate

    @property
    def friction_use(self) -> float:
        """Largest |friction| / normal force, at the nodes and between them [-]."""
        return self.best.friction_use
