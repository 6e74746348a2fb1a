"""Grid of a gait: nodes over the support phases, and points between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.numeric import read_only

if TYPE_CHECKING:
    from jaxtyping import Float

POINTS = 4
"""Gauss-Legendre points in each cell, for bounds on every gait."""
DEGREE, SAMPLES = 6, 400
"""Least degree of the polynomials through a cell's samples, and about the samples of a step:
in cells of pi / 8 a degree of 5 has errors of 3e-3 in the inertia functions."""
CLOSER = 1.5
"""Power of a node's number that its distance from rest goes with. The first cell's time is in error
by its length to the power 1.5: above 4/3 that is of second order in the number of cells."""


@dataclass(frozen=True)
class Grid:
    """K cells in each of n support phases.

    from_rest, to_rest: the walk begins or ends with no speed. There nodes stand closer (CLOSER),
    since the crank rate grows with the root of the angle; elsewhere they are pi / K apart.
    """

    steps: int
    cells: int
    from_rest: bool = False
    to_rest: bool = False

    @cached_property
    def theta(self) -> Float[np.ndarray, "n K+1"]:
        """Nodes as crank angles of the supporting leg [rad]; both ends of every phase."""
        share = np.linspace(0.0, 1.0, self.cells + 1)
        rows = np.tile(share, (self.steps, 1))
        if self.steps == 1 and self.from_rest and self.to_rest:
            near, far = share**CLOSER, (1 - share) ** CLOSER
            rows[0] = near / (near + far)
        else:
            if self.from_rest:
                rows[0] = share**CLOSER
            if self.to_rest:
                rows[-1] = 1 - (1 - share) ** CLOSER
        theta = SUPPORT_START + (SUPPORT_END - SUPPORT_START) * rows
        theta[:, 0], theta[:, -1] = SUPPORT_START, SUPPORT_END
        return read_only(theta)

    @cached_property
    def h(self) -> Float[np.ndarray, "n K"]:
        """Length of each cell [rad]."""
        return read_only(np.diff(self.theta, axis=1))

    @cached_property
    def weights(self) -> Float[np.ndarray, "n K+1"]:
        """Weights of the trapezoid rule over the phase [rad]."""
        ends = np.zeros((self.steps, 1))
        return read_only((np.hstack([self.h, ends]) + np.hstack([ends, self.h])) / 2)

    @cached_property
    def inside(self) -> tuple[Float[np.ndarray, "n K Q"], Float[np.ndarray, "n K Q"]]:
        """Points inside the cells, from each cell's left node [rad], and their weights [rad].

        Gauss and Legendre's; in a cell at rest at one end in the root of the distance from it, in
        which integrals over time are smooth.
        """
        x, w = np.polynomial.legendre.leggauss(POINTS)
        x, w = (x + 1) / 2, w / 2
        share = np.broadcast_to(x, (*self.h.shape, POINTS)).copy()
        weight = np.broadcast_to(w, share.shape).copy()
        if self.from_rest:
            share[0, 0], weight[0, 0] = x**2, 2 * x * w
        if self.to_rest:
            share[-1, -1], weight[-1, -1] = 1 - x[::-1] ** 2, (2 * x * w)[::-1]
        return read_only(share * self.h[..., None]), read_only(weight * self.h[..., None])

    @cached_property
    def samples(self) -> Float[np.ndarray, "n K D+1"]:
        """Crank angles in each cell, its ends included, through which polynomials are laid [rad]:
        Chebyshev's."""
        degree = max(DEGREE, -(-SAMPLES // self.cells))
        share = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
        found = self.theta[:, :-1, None] + share * self.h[..., None]
        found[..., -1] = self.theta[:, 1:]
        return read_only(found)
