"""Settings of a walk's computation: fidelity, integrator, step, precision; a robot's own time."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.model import Fidelity, require_fidelity
from stickslip.dynamics.biped.stepping.integrators import EventExact, Integrator, integrator_of
from stickslip.dynamics.checks import require_choice, require_number

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.params import BipedParams

DTYPES = ("float32", "float64")


@dataclass(frozen=True)
class Setting:
    """Fidelity, integrator, step size and precision of a computation. Static, hashable.

    fidelity, integrator: names or instances, kept as instances. dt: length of a step [s]; for
    EventExact, which chooses its own steps, the time between its outputs. dtype: of the robot, the
    scene and the state.
    """

    fidelity: Fidelity = "table"
    integrator: str | Integrator = "rk4_split"
    dt: float = 0.02
    dtype: str = "float32"

    def __post_init__(self):
        object.__setattr__(self, "fidelity", require_fidelity(self.fidelity))
        object.__setattr__(self, "integrator", integrator_of(self.integrator))
        require_number("dt", self.dt, low=0.0, strict=True, accepted="a finite time step > 0 [s]")
        require_choice("dtype", self.dtype, DTYPES)

    def integrator_over(self, period: float) -> Integrator:
        """The integrator for one call over `period` [s], in steps of at most dt."""
        accepted = "a finite time > 0 [s]"
        require_number("period", period, low=0.0, strict=True, accepted=accepted)
        integrator = integrator_of(self.integrator)
        if isinstance(integrator, EventExact):
            return integrator
        return replace(integrator, substeps=max(1, math.ceil(period / self.dt * (1 - 1e-6))))


def own_time(params: BipedParams) -> Float[Array, ""]:
    """The robot's own unit of time, sqrt(crank / gravity) [s]: 55.3 ms for the default one.

    Robots of any size with the same ratios of lengths and of masses walk alike in it, under torques
    in proportion to weight times crank.
    """
    return jnp.sqrt(jnp.asarray(params.crank) / jnp.asarray(params.gravity))


def precision(dtype: str):
    """A context with float64 where it is asked for, else with the user's own switch as it is."""
    return jax.enable_x64(True) if dtype == "float64" else nullcontext()
