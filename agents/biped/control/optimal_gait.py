"""Follow the best gait of all that do not slip, for whatever mean crank rate is commanded."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.control.action import action_of
from stickslip.agents.biped.control.admissible import admissible
from stickslip.agents.biped.control.secant import after_a_period, secant
from stickslip.agents.protocol import Memoryless
from stickslip.dynamics.biped import SUPPORT_START, BipedParams
from stickslip.dynamics.biped.contact import sticking
from stickslip.dynamics.checks import is_concrete, require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.biped.state import drawn_robot

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.optim.gait.gait import Gait

RATES = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
"""Mean crank rates of the usual gaits [rad/s]."""
CELLS = 64
"""Of their grid."""


class GaitTable(NamedTuple):
    """Periodic gaits of growing mean crank rate [R]: b = crank rate^2 [R, K+1] and a, the crank
    acceleration [R, K+1], at K + 1 evenly spaced crank angles of the support phase.

    Between two of them the mixture is taken: limits are convex in (a, b), so that what two gaits
    keep their mixture keeps, too; its mean rate is at least the mixture of theirs.
    """

    mean_rate: ArrayLike
    a: ArrayLike
    b: ArrayLike

    @classmethod
    def of(cls, gaits: Sequence[Gait]) -> GaitTable:
        """Of periodic gaits. ValueError where there is none, or where grids differ."""
        rows = sorted(gaits, key=lambda gait: gait.mean_rate)
        if not rows or len({gait.a.shape for gait in rows}) > 1 or rows[0].grid.steps != 1:
            raise ValueError("gaits; accepted: one or more periodic ones, of equally many cells")
        rates = np.array([gait.mean_rate for gait in rows])
        return cls(rates, np.stack([g.a[0] for g in rows]), np.stack([g.b[0] for g in rows]))

    def target(
        self, mean_rate: Float[Array, ""], phase: Float[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """a and b at a phase, beyond the support phase those of the next step."""
        rates, a, b = (jnp.asarray(part, phase.dtype) for part in self)
        row = jnp.clip(jnp.searchsorted(rates, mean_rate) - 1, 0, max(rates.shape[0] - 2, 0))
        above = jnp.minimum(row + 1, rates.shape[0] - 1)
        apart = rates[above] - rates[row]
        share = jnp.where(apart > 0, (mean_rate - rates[row]) / jnp.where(apart > 0, apart, 1), 0)
        share = jnp.clip(share, 0.0, 1.0)
        cells = a.shape[1] - 1
        place = jnp.mod(phase - SUPPORT_START, np.pi) / np.pi * cells
        cell = jnp.clip(jnp.floor(place).astype(jnp.int32), 0, cells - 1)
        h = np.pi / cells
        x = (place - cell.astype(place.dtype)) * h

        def at(i: Array) -> tuple[Array, Array]:
            start = a[i, cell]
            rise = (a[i, cell + 1] - start) / h
            return start + rise * x, b[i, cell] + 2 * start * x + rise * x**2

        (a_slow, b_slow), (a_fast, b_fast) = at(row), at(above)
        return a_slow + share * (a_fast - a_slow), b_slow + share * (b_fast - b_slow)


@register_pytree
@dataclass(frozen=True)
class OptimalGait(Memoryless):
    """Follow a gait found by `stickslip.optim.GaitProblem`, from any state.

    Without slip the energy M w^2 / 2 + V changes by the motor's work alone, so that a walk off its
    gait by E - E* is brought back by the torque of one control period, wherever on the step it is:
    a feedback on the crank rate whose gain M w / (turn of a period) changes along the step. The
    torque is held for a period, so it is chosen by prediction, as computed torque does. Far from
    the gait (a start from rest, a slide, a push) the torque is kept where |f| <= friction x N and
    the zero-moment point within `footing` of the way to toe and heel.

    friction [-]: the coefficient relied on, to be set below the floor's. footing [-]: share of the
    foot, in (0, 1]. gaits: a GaitTable; by default those of least friction demand of the reference
    robot with a motor of 3.6 N m at 1 to 7 rad/s. The commanded rate picks among them, beyond their
    ends the nearest one. Masses are read from the true state, never the floor's friction.
    """

    friction: ArrayLike = 0.05
    footing: ArrayLike = 0.8
    gaits: GaitTable = field(default_factory=lambda: usual_gaits())

    @classmethod
    def of(cls, *gaits: Gait, friction: ArrayLike = 0.05, footing: ArrayLike = 0.8) -> OptimalGait:
        """That follows these periodic gaits, each for its own mean crank rate."""
        return cls(friction, footing, GaitTable.of(gaits)).validate()

    def validate(self) -> OptimalGait:
        """Return self, or raise ValueError naming the field."""
        require_number("friction", self.friction, low=0.0, strict=True, accepted="finite, > 0")
        require_number("footing", self.footing, low=0.0, strict=True, accepted="in (0, 1]")
        if is_concrete(self.footing) and np.any(np.asarray(self.footing) > 1):
            raise ValueError(f"footing = {self.footing} is not accepted; accepted: in (0, 1]")
        if not isinstance(self.gaits, GaitTable):
            raise ValueError("gaits; accepted: a GaitTable, as GaitTable.of makes it")
        for name, value in self.gaits._asdict().items():
            require_number(f"gaits.{name}", value, accepted="finite numbers")
        return self

    def act(
        self,
        memory: None,
        obs: Float[Array, " obs"],
        env_state: BipedEnvState,
        env_params: BipedEnvParams,
    ) -> tuple[None, Float[Array, " 1"]]:
        """See Controller."""
        dtype = env_state.biped.crank_rate.dtype
        period = jnp.asarray(env_params.control_period, dtype)
        commanded = jnp.asarray(env_state.drawn.commanded_rate, dtype)
        robot, biped = drawn_robot(env_state.drawn, env_params), env_state.biped
        inertia = robot.inertia.at(biped.phase)
        idle = sticking(robot, inertia, biped.crank_rate, jnp.zeros((), dtype))
        driven = sticking(robot, inertia, biped.crank_rate, jnp.ones((), dtype))
        low, high = admissible(robot, biped, idle, driven, self.friction, self.footing)
        a, _ = self.gaits.target(commanded, biped.phase)
        guess = inertia.M * (a - idle.crank_acceleration)

        def miss(torque: Float[Array, ""]) -> Float[Array, ""]:
            after = after_a_period(robot, biped, torque, period, self.friction)
            _, wanted = self.gaits.target(commanded, after.phase)
            return after.crank_rate - jnp.sqrt(jnp.maximum(wanted, 0.0))

        torque = secant(miss, jnp.clip(guess, low, high), period / inertia.M)
        torque = jnp.clip(torque, low, high)
        return memory, action_of(torque, env_params, env_state)


@lru_cache(maxsize=1)
def usual_gaits() -> GaitTable:
    """Those of the reference robot; computed once."""
    return gaits_of(BipedParams.from_bars(), RATES, "friction", torque_limit=3.6)


def gaits_of(
    robot: BipedParams,
    rates: Sequence[float],
    objective: str | Mapping[str, float] = "friction",
    *,
    mu: float | None = None,
    torque_limit: float | None = None,
    zmp: bool = False,
    steps: int = CELLS,
) -> GaitTable:
    """The best gaits for each of the mean crank rates [rad/s] for which there is one.

    Else as GaitProblem.periodic. ValueError where there is none for any of them.
    """
    from stickslip.optim.gait.problem import GaitProblem
    from stickslip.optim.solving import solve

    found, said = [], ""
    for rate in rates:
        problem = GaitProblem.periodic(
            robot, objective, mu=mu, torque_limit=torque_limit, mean_rate=rate, zmp=zmp, steps=steps
        )
        result = solve(problem)
        if result.gait is None or not result.status.solved:
            said = result.message
            continue
        found.append(result.best)
    if not found:
        raise ValueError(f"no gait for any of the rates: {said}; accepted: rates that can be met")
    return GaitTable.of(found)
