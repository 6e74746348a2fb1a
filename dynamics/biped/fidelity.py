"""Fidelities: one interface to M, P and Y, from the full system to a fitted table.

Whatever the fidelity, the reduced equations (contact.py), the friction switching and the
integrators are the same; it says where their coefficients come from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.dynamics.biped.bodies.joint_inertia import JointInertia
from stickslip.dynamics.biped.coefficients.series import Chebyshev, SeriesInertia, fit_series
from stickslip.dynamics.biped.coefficients.table import ExactInertia, Table, TableInertia, fit_table
from stickslip.dynamics.checks import nearest, shown
from stickslip.dynamics.derived import settle
from stickslip.dynamics.numeric import require_one

if TYPE_CHECKING:
    from stickslip.dynamics.biped.params import BipedParams

Inertia = JointInertia | ExactInertia | TableInertia | SeriesInertia


@dataclass(frozen=True)
class Joint:
    """The full Newton-Euler system, solved for the coefficients at every call (eqs. 18, 28, 36)."""


@dataclass(frozen=True)
class Reduced:
    """M, P, Y exact, by differentiating the closed linkage."""


@dataclass(frozen=True)
class Paper:
    """The paper's: the full system with forward differences (eqs. 23-25 as they should read).

    step: the paper's D, a crank angle [rad].
    """

    step: float = 1e-3

    def __post_init__(self):
        accepted = "a crank angle in (0, 0.5] rad"
        step = require_one("step", self.step, low=0.0, strict=True, high=0.5, accepted=accepted)
        settle(self, step=step)


Fidelity = str | Joint | Reduced | Table | Chebyshev | Paper
"""A name out of FIDELITIES, or one of their classes with other settings."""

FIDELITIES: dict[str, Fidelity] = {
    "joint": Joint(),
    "reduced": Reduced(),
    "table": Table(),
    "chebyshev": Chebyshev(),
    "paper": Paper(),
}
"""Fidelities by name, with default settings."""


def require_fidelity(fidelity: Fidelity) -> Joint | Reduced | Table | Chebyshev | Paper:
    """The fidelity's settings; ValueError for an unknown one."""
    if isinstance(fidelity, Joint | Reduced | Table | Chebyshev | Paper):
        return fidelity
    if not isinstance(fidelity, str) or fidelity not in FIDELITIES:
        raise ValueError(
            f"fidelity = {shown(fidelity)} is unknown; accepted: "
            f"{', '.join(map(repr, FIDELITIES))} or an instance such as Table(...)"
            f"{nearest(fidelity, FIDELITIES)}"
        )
    return FIDELITIES[fidelity]  # type: ignore[return-value]


def inertia_of(params: BipedParams, fidelity: Fidelity) -> Inertia:
    """The inertia functions of a robot. Pure: under vmap every member gets its own table."""
    spec = require_fidelity(fidelity)
    if isinstance(spec, Table):
        return fit_table(params, spec)
    if isinstance(spec, Chebyshev):
        return fit_series(params, spec)
    if isinstance(spec, Reduced):
        return ExactInertia(params)
    return JointInertia(params, spec.step if isinstance(spec, Paper) else None)
