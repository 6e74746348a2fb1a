"""A robot made ready for stepping: its inertia functions and the few constants beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.kinematics import exchange_mismatch, kinematics, step_length
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.table import ExactInertia, Table, TableInertia, fit_table
from stickslip.dynamics.numeric import Numeric

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.biped.inertia import GroundMoment, ReducedInertia

FIDELITIES = ("reduced", "table")

Fidelity = str | Table
"""How M, P and Y are computed: "reduced" (exact), "table" (fitted, default size) or a Table."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BipedModel:
    """What a step needs of a robot. Build it once with `prepare` and step with it many times."""

    params: BipedParams
    """The robot it was made from, the scene's payload included."""
    inertia: ExactInertia | TableInertia | LoadedInertia
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
    table = table_of(fidelity)
    if payload is not None:
        params = replace(params, payload=params.payload + jnp.asarray(payload))
    params = params.astype(jnp.result_type(*map(jnp.result_type, jax.tree.leaves(params))))
    eps = jnp.finfo(jnp.result_type(params.crank)).eps
    return BipedModel(
        params=params,
        inertia=ExactInertia(params) if table is None else fit_table(params, table),
        total_mass=params.total_mass,
        gravity=jnp.asarray(params.gravity),
        step_length=step_length(params),
        heel=jnp.asarray(params.heel),
        toe=jnp.asarray(params.toe),
        closes=_closes(params),
        symmetric=exchange_mismatch(params) < max(1e-6, 1e3 * float(eps)),
    )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LoadedInertia:
    """Inertia functions of a robot with other masses; they are linear in the masses.

    empty: of the robot itself. unit: of 1 kg at the hip's centre and nothing else.
    """

    empty: ExactInertia | TableInertia
    unit: ExactInertia | TableInertia | None
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
    unit: ExactInertia | TableInertia | None,
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


def unit_payload(params: BipedParams, fidelity: Fidelity) -> ExactInertia | TableInertia:
    """Inertia functions of 1 kg at the hip's centre alone, for `load`."""
    table = table_of(fidelity)
    nothing = jnp.zeros_like(jnp.asarray(params.mass))
    alone = replace(
        params,
        mass=nothing,
        inertia=jnp.zeros_like(nothing),
        payload=jnp.ones_like(jnp.asarray(params.payload)),
    )
    return ExactInertia(alone) if table is None else fit_table(alone, table)


def table_of(fidelity: Fidelity) -> Table | None:
    """The table that a fidelity asks for, None for the exact functions; ValueError if unknown."""
    if isinstance(fidelity, Table):
        return fidelity
    if fidelity not in FIDELITIES:
        raise ValueError(
            f"fidelity = {fidelity!r} is unknown; accepted: 'reduced', 'table' or a Table(...)"
        )
    return Table() if fidelity == "table" else None


def _closes(params: BipedParams, samples: int = 128) -> Bool[Array, ""]:
    """Both legs over the support phase: the whole turn of either."""
    angles = jnp.asarray(
        (0.5 + np.arange(samples) / samples) * np.pi, jnp.result_type(params.crank)
    )
    closure = jax.vmap(lambda angle: kinematics(params, angle).closure)(angles)
    return jnp.min(closure) >= 0
