"""Static choices of a computation: fidelity, integrator, step, precision. Hashable, one class each.

The fidelity says where the coefficients M, P and Y of the reduced equations come from. Integrators
share these equations, the friction switching (contact.py), the exchange of support, the statuses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import jax
import numpy as np

from stickslip.dynamics.checks import nearest, require_choice, require_integer, require_kind, shown
from stickslip.dynamics.pytrees import require_one, settle

Choice = TypeVar("Choice")


@dataclass(frozen=True)
class Joint:
    """The full Newton-Euler system, solved for the coefficients at every call (eqs. 18, 28, 36)."""


@dataclass(frozen=True)
class Reduced:
    """M, P, Y exact, by differentiating the closed linkage."""


@dataclass(frozen=True)
class Table:
    """Piecewise polynomials: number of pieces and degree.

    In float64 32 pieces of degree 7 hold the default robot's values to 2e-10, slopes to 2e-8 (SI).
    """

    pieces: int = 32
    degree: int = 7

    def __post_init__(self):
        require_integer("pieces", self.pieces, high=4096)
        require_integer("degree", self.degree, low=2, high=12)


@dataclass(frozen=True)
class Chebyshev:
    """Chebyshev series of the given degree."""

    degree: int = 48

    def __post_init__(self):
        require_integer("degree", self.degree, low=4, high=256)


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

FIDELITIES: dict[str, Joint | Reduced | Table | Chebyshev | Paper] = {
    "joint": Joint(),
    "reduced": Reduced(),
    "table": Table(),
    "chebyshev": Chebyshev(),
    "paper": Paper(),
}
"""Fidelities by name, with default settings."""


def require_fidelity(fidelity: Fidelity) -> Joint | Reduced | Table | Chebyshev | Paper:
    """The fidelity's settings; ValueError for an unknown one."""
    return _chosen("fidelity", fidelity, FIDELITIES, "Table(...)")


def _chosen(what: str, given: str | Choice, known: Mapping[str, Choice], instance: str) -> Choice:
    """The settings of that name, or the instance itself; ValueError for anything else."""
    if isinstance(given, str) and given in known:
        return known[given]
    if isinstance(given, str) or type(given) not in map(type, known.values()):
        raise ValueError(
            f"{what} = {shown(given)} is unknown; accepted: {', '.join(map(repr, known))} or an "
            f"instance such as {instance}{nearest(given, known)}"
        )
    return given


MOST_STEPS = 10**6
"""Inside one call; more is more than a call's time has places for in double precision."""


def _require_counts(spec: Euler | RK4Split | EventExact, *counts: str) -> None:
    """Check whole numbers and record_events."""
    for name in counts:
        require_integer(name, getattr(spec, name), high=MOST_STEPS)
    require_kind("record_events", spec.record_events, bool, "True or False")


@dataclass(frozen=True)
class Euler:
    """The paper's: accelerations constant during a step (eqs. 27, 35), stopped at t_s (eq. 36).

    Fixed steps, in the mode that holds at their start. Onset of sliding, exchange of support, patch
    edges and a walk's end wait for a step's end. A slide that stops inside a step ends there, and
    the rest of the step is taken from rest, so each step solves the motion twice. Order 1.
    substeps: steps that one call of `step` is divided into. record_events: report what was switched
    in Contact.events; instants are those of the steps' ends.
    """

    substeps: int = 1
    record_events: bool = False

    def __post_init__(self):
        _require_counts(self, "substeps")

    @property
    def log_size(self) -> int:
        """The most events of one call: slip, stop, slip back and exchange in every substep."""
        return 4 * self.substeps


@dataclass(frozen=True)
class RK4Split:
    """Fixed Runge-Kutta steps that are split at every switching instant. Order 4 throughout.

    substeps: Runge-Kutta steps that one call of `step` is divided into. max_events: switching
    instants located in one call, for which three trials each are allowed; beyond them the rest of
    the call is taken unsplit. record_events: report the instants in Contact.events.
    """

    substeps: int = 1
    max_events: int = 4
    record_events: bool = False

    close: ClassVar[Mapping[str, float]] = {"float32": 0.01, "float64": 0.01}
    """A trial within this fraction of itself of an event is corrected onto the event."""
    reach: ClassVar[float] = 1.0
    """A trial aimed at an event and this fraction of itself short of it is aimed again."""

    def __post_init__(self):
        _require_counts(self, "substeps", "max_events")

    @property
    def trials(self) -> int:
        """The most Runge-Kutta steps that one call can take."""
        return self.substeps + 3 * self.max_events

    log_size = trials
    """The most events of one call."""


@dataclass(frozen=True)
class EventExact:
    """Adaptive Dormand-Prince 5(4) steps; every switching instant by Newton's method, whose last
    step is from within 1e-6 of a step of the integrator (float32: 1e-3).

    rtol, atol: of crank angle [rad], crank rate [rad/s], slide [m] and foot velocity [m/s] a step;
    rtol counts as at least 32 units in the last place of the working precision. max_steps: steps of
    one call, rejected and repeated ones included; if they do not suffice the status is
    NOT_CONVERGED. max_turn: largest turn of the crank in one step [rad], so that no switch hides
    between two samples. record_events: report the instants in Contact.events (the first 32).
    """

    rtol: float = 1e-9
    atol: float = 1e-12
    max_steps: int = 1024
    max_turn: float = 0.1
    record_events: bool = False

    log_size: ClassVar[int] = 32
    """Number of events of one call that are recorded."""
    close: ClassVar[Mapping[str, float]] = {"float32": 1e-3, "float64": 1e-6}
    reach: ClassVar[float] = 0.1
    """See RK4Split. Farther off, aims from one start might alternate for ever: the step stands,
    and the next one begins nearer."""

    def __post_init__(self):
        _require_counts(self, "max_steps")
        for name, high in (("rtol", 0.1), ("atol", 0.1), ("max_turn", 1.0)):
            accepted = f"above 0, up to {high:g}"
            rule = {"low": 0.0, "strict": True, "high": high, "dtype": np.float64}
            value = require_one(name, getattr(self, name), accepted=accepted, **rule)
            settle(self, **{name: value})

    @property
    def trials(self) -> int:
        """The most Runge-Kutta steps that one call can take."""
        return self.max_steps


Integrator = Euler | RK4Split | EventExact

INTEGRATORS = {"euler": Euler(), "rk4_split": RK4Split(), "event_exact": EventExact()}
"""Integrators by name, with default settings."""


def integrator_of(integrator: str | Integrator) -> Integrator:
    """The integrator's settings; ValueError for an unknown one."""
    return _chosen("integrator", integrator, INTEGRATORS, "RK4Split(...)")


DTYPES = ("float32", "float64")


@dataclass(frozen=True)
class Setting:
    """Fidelity, integrator, step size and precision of a computation.

    fidelity, integrator: names or instances, kept as instances. dt: length of a step [s]; for
    EventExact the time between outputs. dtype: of the robot, the scene and the state.
    """

    fidelity: Fidelity = "table"
    integrator: str | Integrator = "rk4_split"
    dt: float = 0.02
    dtype: str = "float32"

    def __post_init__(self):
        settle(self, fidelity=require_fidelity(self.fidelity))
        settle(self, integrator=integrator_of(self.integrator))
        require_one("dt", self.dt, low=0.0, strict=True, accepted="a finite time step > 0 [s]")
        require_choice("dtype", self.dtype, DTYPES)

    def integrator_over(self, period: float) -> Integrator:
        """The integrator for one call over `period` [s], in steps of at most dt."""
        require_one("period", period, low=0.0, strict=True, accepted="a finite time > 0 [s]")
        integrator = integrator_of(self.integrator)
        if isinstance(integrator, EventExact):
            return integrator
        return replace(integrator, substeps=max(1, math.ceil(period / self.dt * (1 - 1e-6))))


def precision(dtype: str):
    """A context with float64 where it is asked for, else with the user's own switch as it is."""
    return jax.enable_x64(True) if dtype == "float64" else nullcontext()
