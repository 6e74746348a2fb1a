"""A robot made ready for stepping: its inertia functions and the few constants beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.kinematics import exchange_mismatch, kinematics, step_length
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.table import ExactInertia, Table, TableInertia, fit_table

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Bool, Float

FIDELITIES = ("reduced", "table")

Fidelity = str | Table
"""How M, P and Y are computed: "reduced" (exact), "table" (fitted, default size) or a Table."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BipedModel:
    """What a step needs of a robot. Build it once with `prepare` and step with it many times."""

    inertia: ExactInertia | TableInertia
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
    payload: ArrayLike | None = None,
) -> BipedModel:
    """Make a robot ready for stepping; a model passes through unchanged.

    fidelity: see Fidelity. payload: mass [kg] added at the hip's centre beside params.payload.
    Pure: under vmap every member gets its own table. Raises ValueError for an unknown fidelity.
    """
    if isinstance(params, BipedModel):
        return params
    table = table_of(fidelity)
    if payload is not None:
        params = replace(params, payload=params.payload + jnp.asarray(payload))
    params = params.astype(jnp.result_type(*map(jnp.result_type, jax.tree.leaves(params))))
    eps = jnp.finfo(jnp.result_type(params.crank)).eps
    return BipedModel(
        inertia=ExactInertia(params) if table is None else fit_table(params, table),
        total_mass=params.total_mass,
        gravity=jnp.asarray(params.gravity),
        step_length=step_length(params),
        heel=jnp.asarray(params.heel),
        toe=jnp.asarray(params.toe),
        closes=_closes(params),
        symmetric=exchange_mismatch(params) < max(1e-6, 1e3 * float(eps)),
    )


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
    angles = (0.5 + jnp.arange(samples) / samples) * jnp.pi
    closure = jax.vmap(lambda angle: kinematics(params, angle).closure)(
        angles.astype(jnp.result_type(params.crank))
    )
    return jnp.min(closure) >= 0
