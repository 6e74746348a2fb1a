"""A robot made ready for stepping: its inertia functions and the few constants beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.fidelity import Fidelity, Inertia, inertia_of
from stickslip.dynamics.biped.kinematics import exchange_mismatch, least_closure, step_length
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.numeric import Numeric, float_type

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.biped.inertia import GroundMoment, ReducedInertia


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BipedModel:
    """What a step needs of a robot. Build it once with `prepare` and step with it many times."""

    params: BipedParams
    """The robot it was made from, the scene's payload included."""
    inertia: Inertia | LoadedInertia
    total_mass: Float[Array, ""]
    gravity: Float[Array, ""]
    step_length: Float[Array, ""]
    heel: Float[Array, ""]
    toe: Float[Array, ""]
    closes: Bool[Array, ""]
    """The linkage closes at every crank angle."""
    symmetric: Bool[Array, ""]
    """Support can be exchanged without an impact."""


def prepare(
    params: BipedParams | BipedModel,
    *,
    fidelity: Fidelity = "reduced",
    payload: Numeric | None = None,
) -> BipedModel:
    """Make a robot ready for stepping; a model passes through unchanged.

    fidelity: see Fidelity. payload: mass [kg] added at the hip's centre beside params.payload, not
    accepted for a model.
    Pure: under vmap every member gets its own table. Raises ValueError for an unknown fidelity.
    """
    if isinstance(params, BipedModel):
        if payload is not None:
            raise ValueError(
                "payload in a scene for a model that is prepared already; accepted: "
                "prepare(params, payload=...) and a scene without"
            )
        return params
    if payload is not None:
        params = replace(params, payload=params.payload + jnp.asarray(payload))
    params = params.astype(float_type(params))
    eps = jnp.finfo(jnp.result_type(params.crank)).eps
    return BipedModel(
        params=params,
        inertia=inertia_of(params, fidelity),
        total_mass=params.total_mass,
        gravity=jnp.asarray(params.gravity),
        step_length=step_length(params),
        heel=jnp.asarray(params.heel),
        toe=jnp.asarray(params.toe),
        closes=least_closure(params, 256)[0] >= 0,
        symmetric=exchange_mismatch(params) < max(1e-6, 1e3 * float(eps)),
    )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LoadedInertia:
    """Inertia functions of a robot with other masses; they are linear in the masses.

    empty: of the robot itself. unit: of 1 kg at the hip's centre and nothing else.
    """

    empty: Inertia
    unit: Inertia | None
    mass_factor: Float[Array, ""]
    payload: Float[Array, ""]

    def at(self, theta: Float[Array, ""]) -> ReducedInertia:
        """M, P, Y and slopes at `theta` [rad]."""
        return self._sum(lambda inertia: inertia.at(theta))

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """What the ground's moment about the ankle takes, at `theta` [rad]."""
        return self._sum(lambda inertia: inertia.moment_at(theta))

    def _sum(self, of):
        scaled = jax.tree.map(lambda value: self.mass_factor * value, of(self.empty))
        if self.unit is None:
            return scaled
        return jax.tree.map(lambda a, b: a + self.payload * b, scaled, of(self.unit))


def load(
    model: BipedModel,
    unit: Inertia | None,
    mass_factor: Numeric,
    payload: Numeric = 0.0,
) -> BipedModel:
    """The model with every mass and inertia times `mass_factor`, and `payload` [kg] on the hip.

    Fits nothing again: the functions are sums (see LoadedInertia). unit: from `unit_payload`, or
    None for no payload, and nothing compiled for it. model.params stays the unloaded robot.
    """
    factor, extra = jnp.asarray(mass_factor), jnp.asarray(payload)
    extra = jnp.zeros_like(extra) if unit is None else extra
    return replace(
        model,
        inertia=LoadedInertia(model.inertia, unit, factor, extra),  # type: ignore[arg-type]
        total_mass=model.total_mass * factor + extra,
    )


def unit_payload(params: BipedParams, fidelity: Fidelity) -> Inertia:
    """Inertia functions of 1 kg at the hip's centre alone, for `load`."""
    nothing = jnp.zeros_like(jnp.asarray(params.mass))
    alone = replace(
        params,
        mass=nothing,
        inertia=jnp.zeros_like(nothing),
        payload=jnp.ones_like(jnp.asarray(params.payload)),
    )
    return inertia_of(alone, fidelity)


def loaded_params(model: BipedModel) -> BipedParams:
    """The robot with the masses that `load` gave it."""
    load = model.inertia
    if not isinstance(load, LoadedInertia):
        return model.params
    mass, inertia = (
        load.mass_factor * jnp.asarray(m) for m in (model.params.mass, model.params.inertia)
    )
    payload = load.mass_factor * model.params.payload + load.payload
    return replace(model.params, mass=mass, inertia=inertia, payload=payload)
