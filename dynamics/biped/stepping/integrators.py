"""The integrators' settings: static, hashable, one class each.

All of them share the friction switching (`contact.mode_of`), the exchange of support and the
statuses. The unsplit ones look at the floor at the beginning of each of their steps and take the
step in that mode; RK4Split and EventExact stop at every switching instant.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.dynamics.checks import nearest, require_integer, require_kind, shown
from stickslip.dynamics.numeric import require_one
from stickslip.dynamics.pytrees import settle

MOST_STEPS = 10**6
"""Inside one call; more is more than a call's time has places for in double precision."""


def _require(spec: Unsplit | RK4Split | EventExact, *counts: str) -> None:
    """Check whole numbers and record_events, and the memory of a record."""
    for name in counts:
        require_integer(name, getattr(spec, name), high=MOST_STEPS)
    require_kind("record_events", spec.record_events, bool, "True or False")


@dataclass(frozen=True)
class Unsplit:
    """Fixed steps that switch, and end, at their ends only. Error of first order wherever they do.

    substeps: steps that one call of `step` is divided into. record_events: report what was switched
    in Contact.events; instants are those of the steps' ends.
    """

    substeps: int = 1
    record_events: bool = False

    def __post_init__(self):
        _require(self, "substeps")

    @property
    def log_size(self) -> int:
        """The most events of one call: slip, stop, slip back and exchange in every substep."""
        return 4 * self.substeps


@dataclass(frozen=True)
class Euler(Unsplit):
    """The paper's: accelerations constant during a step (eqs. 27, 35), stopped at t_s (eq. 36).

    A slide that stops inside a step ends there, and the rest of the step is taken from rest, so
    each step solves the motion twice. Order 1.
    """


@dataclass(frozen=True)
class SemiImplicitEuler(Unsplit):
    """Velocities first, positions with the new ones. Order 1; one solution of the motion a step."""


@dataclass(frozen=True)
class RK4(Unsplit):
    """The classical Runge-Kutta step in one mode. Order 4 between switches, 1 across them."""


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

    close: ClassVar[float] = 0.01
    """A trial within this fraction of itself of an event is corrected onto the event."""
    reach: ClassVar[float] = 1.0
    """A trial aimed at an event and this fraction of itself short of it is aimed again."""

    def __post_init__(self):
        _require(self, "substeps", "max_events")

    @property
    def trials(self) -> int:
        """The most Runge-Kutta steps that one call can take."""
        return self.substeps + 3 * self.max_events

    @property
    def log_size(self) -> int:
        """The most events of one call."""
        return self.trials


@dataclass(frozen=True)
class EventExact:
    """Adaptive Dormand-Prince 5(4) steps, every switching instant located to the tolerance.

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
    close: ClassVar[float] = 1e-3
    reach: ClassVar[float] = 0.1
    """As of RK4Split. Farther off, aims from one start might alternate for ever: the step stands,
    and the next one begins nearer."""

    def __post_init__(self):
        _require(self, "max_steps")
        for name, high in (("rtol", 0.1), ("atol", 0.1), ("max_turn", 1.0)):
            accepted = f"above 0, up to {high:g}"
            rule = {"low": 0.0, "strict": True, "high": high, "dtype": np.float64}
            value = require_one(name, getattr(self, name), accepted=accepted, **rule)
            settle(self, **{name: value})

    @property
    def trials(self) -> int:
        """The most Runge-Kutta steps that one call can take."""
        return self.max_steps


Integrator = Unsplit | RK4Split | EventExact

INTEGRATORS: dict[str, Integrator] = {
    "euler": Euler(),
    "semi_implicit": SemiImplicitEuler(),
    "rk4": RK4(),
    "rk4_split": RK4Split(),
    "event_exact": EventExact(),
}
"""Integrators by name, with default settings."""


def integrator_of(integrator: str | Integrator) -> Integrator:
    """The integrator's settings; ValueError for an unknown one."""
    if isinstance(integrator, Integrator):
        return integrator
    if not isinstance(integrator, str) or integrator not in INTEGRATORS:
        raise ValueError(
            f"integrator = {shown(integrator)} is unknown; accepted: "
            f"{', '.join(map(repr, INTEGRATORS))} or an instance such as RK4Split(...)"
            f"{nearest(integrator, INTEGRATORS)}"
        )
    return INTEGRATORS[integrator]
