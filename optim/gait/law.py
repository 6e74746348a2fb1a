"""A gait as arrays that are traced: torque over the crank angle, and a feedback that holds it.

Without slip the energy E = M w^2 / 2 + V changes by the motor's work alone: dE/d theta = T, exactly
and for every gait. So the reduced model, linearised about a gait, is an integrator in the energy,
and T = T* - gain (E - E*) takes a deviation away as exp(-gain x angle). In the crank rate that is a
feedback whose gain M w* gain changes along the step; V cancels at one crank angle, so that
E - E* = M (w^2 - b*) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import SUPPORT_START
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.biped import BipedModel
    from stickslip.optim.gait.gait import Gait


@register_pytree
@dataclass(frozen=True)
class GaitLaw:
    """theta [n, K+1] rad, a [n, K+1] rad/s^2, b [n, K+1] rad^2/s^2 as in Gait."""

    theta: Float[Array, "n K+1"]
    a: Float[Array, "n K+1"]
    b: Float[Array, "n K+1"]

    @classmethod
    def of(cls, gait: Gait) -> GaitLaw:
        """The law of a gait, in JAX's own precision."""
        dtype = jnp.result_type(float)
        return cls(*(jnp.asarray(part, dtype) for part in (gait.theta, gait.a, gait.b)))

    def at(
        self, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """a and b at a phase of the step so many exchanges after the first; the last step goes
        on for ever. Beyond a phase's end, within a step's reach, the next step is read."""
        last = self.theta.shape[0] - 1
        beyond = (phase - SUPPORT_START >= np.pi).astype(steps.dtype)
        phase = phase - np.pi * beyond.astype(phase.dtype)
        row = jnp.clip(steps + beyond, 0, last)
        nodes = self.theta[row]
        cells = nodes.shape[0] - 1
        cell = jnp.clip(jnp.searchsorted(nodes, phase, side="right") - 1, 0, cells - 1)
        x = phase - nodes[cell]
        rise = (self.a[row, cell + 1] - self.a[row, cell]) / (nodes[cell + 1] - nodes[cell])
        start = self.a[row, cell]
        return start + rise * x, self.b[row, cell] + 2 * start * x + rise * x**2

    def torque(
        self, model: BipedModel, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> Float[Array, ""]:
        """Torque of the gait there [N m]."""
        a, b = self.at(phase, steps)
        turned = phase - SUPPORT_START
        inertia = model.inertia.at(SUPPORT_START + jnp.mod(turned, np.pi))
        return inertia.M * a + inertia.dM * b / 2 + model.gravity * inertia.Y

    def excess(
        self,
        model: BipedModel,
        phase: Float[Array, ""],
        steps: Int[Array, ""],
        crank_rate: Float[Array, ""],
    ) -> Float[Array, ""]:
        """E - E*, by how much more energy the walk has than the gait there [J]."""
        _, b = self.at(phase, steps)
        return model.inertia.at(phase).M * (crank_rate * jnp.abs(crank_rate) - b) / 2
