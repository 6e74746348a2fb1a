"""The biped's state, the contact report of a step, and a walk's trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.checks import is_concrete, require_number
from stickslip.dynamics.numeric import Numeric, require_broadcast, require_numeric
from stickslip.dynamics.pytrees import register_pytree
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.params import BipedParams


@register_pytree
@dataclass(frozen=True)
class BipedState:
    """State of a walk: `steps` counts exchanges of support, phase and foot_position the rest.

    phase: crank angle of the supporting leg, in [pi/2, 3 pi/2] [rad]. steps: exchanges so far,
    forwards positive (integer). crank_rate [rad/s]. foot_position: slide x1 of eq. (16), the
    supporting ankle's distance from the foothold that `steps` steps without slip lead to [m], kept
    separate from the steps so that single precision holds over long walks. foot_velocity: of the
    supporting foot over the floor, exactly 0 while it is at rest [m/s]. time [s].

    The whole turn of the crank is `crank_angle`, the ankle's place on the floor `floor_position`.
    """

    phase: Numeric = SUPPORT_START
    steps: Numeric = 0
    crank_rate: Numeric = 0.0
    foot_position: Numeric = 0.0
    foot_velocity: Numeric = 0.0
    time: Numeric = 0.0

    @property
    def crank_angle(self) -> Float[Array, ""]:
        """The crank's angle with no wrapping: phase + pi steps [rad]."""
        phase = jnp.asarray(self.phase)
        return phase + np.pi * jnp.asarray(self.steps).astype(phase.dtype)

    def astype(self, dtype: DTypeLike) -> BipedState:
        """The same state as arrays of `dtype`, and steps as int32; time is no number where steps
        are none, so that a step says NON_FINITE."""
        numbers = {name: jnp.asarray(value, dtype) for name, value in vars(self).items()}
        steps = jnp.asarray(self.steps)
        time = jnp.where(jnp.isfinite(numbers["steps"]), numbers["time"], jnp.nan)
        whole = jnp.issubdtype(steps.dtype, jnp.integer)
        numbers |= {"steps": steps.astype(jnp.int32), "time": numbers["time"] if whole else time}
        return BipedState(**numbers)

    def validate(self) -> BipedState:
        """Return self, or raise ValueError naming a field that no walk can have."""
        require_numeric(**vars(self))
        accepted = "a whole number of exchanges, below 2^31"
        require_number("steps", self.steps, low=-(2.0**31), high=2.0**31 - 1, accepted=accepted)
        if is_concrete(self.steps) and np.any(np.asarray(self.steps) % 1 != 0):
            raise ValueError(f"steps = {self.steps}; accepted: {accepted}")
        require_broadcast(**vars(self))
        for name in ("phase", "crank_rate", "foot_position", "foot_velocity", "time"):
            require_number(name, getattr(self, name), low=-np.inf, accepted="a finite number")
        return self.require_support()

    def require_support(self) -> BipedState:
        """Return self, or raise ValueError for a phase at which the leg does not support.

        A phase that is no number passes: a step says NON_FINITE.
        """
        require_numeric(**vars(self))
        if is_concrete(self.phase):
            phase, slack = np.asarray(self.phase), 1e-6
            if np.any((phase < SUPPORT_START - slack) | (phase > SUPPORT_END + slack)):
                raise ValueError(
                    f"phase = {phase} is not accepted; accepted: the supporting leg's crank angle, "
                    "pi/2 to 3 pi/2 rad (a full turn is counted in steps of pi)"
                )
        return self


def floor_position(params: BipedParams | BipedModel, state: BipedState) -> Float[Array, ""]:
    """Floor position of the supporting ankle [m]: steps by step length, plus slide."""
    from stickslip.dynamics.biped.links import step_length
    from stickslip.dynamics.biped.model import BipedModel

    length = params.step_length if isinstance(params, BipedModel) else step_length(params)
    return jnp.asarray(state.steps).astype(length.dtype) * length + state.foot_position


@register_pytree
@dataclass(frozen=True)
class Contact:
    """The foot on the ground at the end of a step, and what happened during it.

    friction_force, normal_force: ground on foot [N]. zmp: from the ankle forwards [m], None when
    the scene's outputs leave it out. mode: 0 sticks, +1 / -1 slides forwards / backwards. status:
    a Status. switches: stick-slip changes, exchanges and patch edges crossed during the step.
    slide_distance: path of the foot over the floor, >= 0 [m]. torque: of the motor [N m]. work,
    positive_work: of the motor, net and counting only what it gives [J]. joint_forces: [68] N in
    the order of JOINT_FORCES, None unless the scene's outputs are "joints". events: None, or times,
    kinds (EventKind) and crank angles of the switches, unused entries of kind NONE.
    """

    friction_force: Float[Array, ""]
    normal_force: Float[Array, ""]
    zmp: Float[Array, ""] | None
    mode: Int[Array, ""]
    status: Int[Array, ""]
    switches: Int[Array, ""]
    slide_distance: Float[Array, ""]
    torque: Float[Array, ""]
    work: Float[Array, ""]
    positive_work: Float[Array, ""]
    joint_forces: Float[Array, " 68"] | None
    events: Events | None


@register_pytree
@dataclass(frozen=True)
class Events:
    """Switching instants within one step, in order; entries past the last have kind NONE."""

    times: Float[Array, " events"]
    kinds: Int[Array, " events"]
    crank_angles: Float[Array, " events"]


@register_pytree
@dataclass(frozen=True)
class Trajectory:
    """A walk in n steps: states [n + 1] with the initial one, torques and contacts [n].

    After a terminal status the last state and contact stand to the end, with nothing more done in
    the steps: work, positive_work, slide_distance and switches 0 and no events, so that sums are
    those of the walk.
    """

    states: BipedState
    torques: Float[Array, " n"]
    contacts: Contact

    @property
    def final(self) -> BipedState:
        """The last state."""
        return jax.tree.map(lambda leaf: leaf[-1], self.states)

    @property
    def status(self) -> Status | Int[Array, ""]:
        """The most severe Status of the walk; an integer inside a trace."""
        gravest = jnp.max(self.contacts.status)
        return Status(int(gravest)) if is_concrete(gravest) else gravest

    def events(self) -> list[tuple[float, str, float]]:
        """(time [s], "slip" | "stick" | "exchange" | "patch", crank angle [rad]) in order.

        For one walk, not a batch, and an integrator with record_events=True; else ValueError.
        """
        events = self.contacts.events
        if events is None or np.ndim(events.kinds) != 2:
            raise ValueError(
                "events need one walk simulated with integrator=RK4Split(record_events=True), or "
                "another integrator's record_events=True"
            )
        used = np.asarray(events.kinds) != EventKind.NONE
        rows = (np.asarray(column)[used].tolist() for column in jax.tree.leaves(events))
        return [(t, EventKind(k).name.lower(), angle) for t, k, angle in zip(*rows, strict=True)]
