"""A robot prepared for stepping: its inertia functions and a few constants."""

from __future__ import annotations

from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp

from stickslip.dynamics import pytrees
from stickslip.dynamics.biped import links, settings
from stickslip.dynamics.biped.inertia import (
    DifferencedInertia,
    ExactInertia,
    GroundMoment,
    Inertia,
    ReducedInertia,
    fit_series,
    fit_table,
)
from stickslip.dynamics.biped.joints import JointInertia
from stickslip.dynamics.biped.links import as_batch, least_closure, step_length
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.checks import as_number, require_kind
from stickslip.dynamics.scene import PAYLOAD

if TYPE_CHECKING:
    from stickslip.dynamics.pytrees import Flag, Integer, Scalar


def inertia_of(params: BipedParams, fidelity: settings.Fidelity) -> Inertia:
    """The inertia functions of a robot. Pure: under vmap every member gets its own table."""
    spec = settings.require_fidelity(fidelity)
    if isinstance(spec, settings.Table):
        return fit_table(params, spec)
    if isinstance(spec, settings.Chebyshev):
        return fit_series(params, spec)
    if isinstance(spec, settings.Reduced):
        return ExactInertia(params)
    return JointInertia(params, spec.step if isinstance(spec, settings.Paper) else None)


@pytrees.pytree_dataclass
class Load:
    """Other masses for a robot that is prepared; see `load`. payload: [kg], None for none."""

    mass_factor: pytrees.Numeric
    payload: pytrees.Numeric | None


def _of_robot(name: str, about: str) -> Any:
    """A number of the robot as it was given, as an array."""
    return property(lambda self: jnp.asarray(getattr(self.bare, name)), doc=about)


@pytrees.pytree_dataclass
class BipedModel:
    """A robot prepared for stepping. Build it once with `prepare` and step with it many times.

    bare, payload, fidelity and load say what it is; the rest is computed from these, again whenever
    `dataclasses.replace` changes one of them.
    """

    bare: BipedParams
    """The robot as it was given, in one floating type."""
    payload: pytrees.Numeric | None = None
    """Mass [kg] added at the hip's centre, the scene's; None for none."""
    fidelity: settings.Fidelity = field(default=settings.Reduced(), metadata={"static": True})
    load: Load | None = None
    """Load added by `load`."""
    fitted: Inertia = field(init=False, repr=False)
    """Inertia functions of the robot with its payload, without the load."""
    unit: Inertia | None = field(init=False, repr=False)
    """Those of 1 kg at the hip's centre, where the load has a payload."""
    own_mass: Scalar = field(init=False, repr=False)
    step_length: Scalar = field(init=False, repr=False)
    closes: Flag = field(init=False, repr=False)
    """The linkage closes at every crank angle."""
    symmetric: Flag = field(init=False, repr=False)
    """Support can be exchanged without an impact."""

    def __post_init__(self):
        require_kind("bare", self.bare, BipedParams, "a BipedParams")
        if self.load is not None:
            require_kind("load", self.load, Load, "None, or what `load` made")
        pytrees.settle(self, fidelity=settings.require_fidelity(self.fidelity))
        parts = dict.fromkeys(("fitted", "own_mass", "step_length", "closes", "symmetric"))
        parts |= self._prepare() if pytrees.holds_numbers(self.bare) else {}
        pytrees.settle(self, unit=None, **parts)
        if self.load is not None and self.load.payload is not None:
            pytrees.settle(self, unit=self.unit_inertia())

    def _prepare(self):
        if self.payload is not None:
            pytrees.settle(self, payload=as_number("payload", self.payload, **PAYLOAD))
        params, extra = self.bare.astype(pytrees.float_type(self.bare, self.payload)), self.payload
        batch, whole = as_batch(params)
        if extra is not None:
            extra = jnp.asarray(extra, whole.payload.dtype)
            batch = jnp.broadcast_shapes(batch, extra.shape)
            pytrees.settle(self, payload=jnp.broadcast_to(extra, batch))
        if batch:
            whole = as_batch(replace(whole, crank=jnp.broadcast_to(whole.crank, batch)))[1]
        pytrees.settle(self, bare=whole)
        return _derive(self.fidelity, self.params)

    @property
    def params(self) -> BipedParams:
        """The robot with the payload, but without the load of `load`."""
        if self.payload is None:
            return self.bare
        return replace(self.bare, payload=self.bare.payload + jnp.asarray(self.payload))

    @property
    def inertia(self) -> Inertia:
        """M, P, Y and the ground moment's functions of the robot as it stands there."""
        if self.load is None:
            return self.fitted
        return LoadedInertia(self.fitted, self.unit, self.load)

    @property
    def total_mass(self) -> Scalar:
        """All 24 bodies, payload and load [kg]."""
        if self.load is None:
            return self.own_mass
        scaled = self.own_mass * self.load.mass_factor
        return scaled if self.load.payload is None else scaled + self.load.payload

    gravity = _of_robot("gravity", "[m/s^2]")
    heel = _of_robot("heel", "The foot's edge behind the ankle [m].")
    toe = _of_robot("toe", "The foot's edge before the ankle [m].")

    def unit_inertia(self) -> Inertia:
        """Inertia functions of 1 kg at the hip's centre alone, for `load`."""
        nothing = jnp.zeros_like(jnp.asarray(self.bare.mass))
        one = jnp.ones_like(jnp.asarray(self.bare.payload))
        bare = replace(self.bare, mass=nothing, inertia=jnp.zeros_like(nothing), payload=one)
        return _derive(self.fidelity, bare)["fitted"]

    def member(self, place: Integer) -> BipedModel:
        """One robot of a batch [n], without a load; what was derived is not derived again."""
        rest = jax.tree.map(lambda leaf: leaf[place], pytrees.rebuilt(self, fitted=None))
        return pytrees.rebuilt(rest, fitted=self.fitted.member(place))

    def replace(self, **changes: Any) -> BipedModel:
        """The model of a robot with some fields of BipedParams changed, prepared for stepping."""
        return replace(self, bare=self.bare.replace(**changes))


def prepare(
    params: BipedParams | BipedModel,
    *,
    fidelity: settings.Fidelity = "reduced",
    payload: pytrees.Numeric | None = None,
) -> BipedModel:
    """Make a robot ready for stepping; a model passes through unchanged.

    fidelity: see Fidelity. payload: mass [kg] added at the hip's centre beside params.payload, not
    accepted for a model.
    Pure: under vmap every member gets its own table. Raises ValueError for an unknown fidelity.
    """
    if isinstance(params, BipedModel):
        if payload is not None:
            given = "payload in a scene for a model that is prepared already"
            raise ValueError(f"{given}; accepted: prepare(params, payload=...) and a scene without")
        return params
    require_kind("params", params, BipedParams, "a BipedParams or a BipedModel")
    pytrees.require_numeric(**vars(params))
    return BipedModel(params, payload, fidelity)


def _derive(spec: settings.Fidelity, params: BipedParams) -> dict[str, Any]:
    """Derived fields of a model, member by member where the robots are a batch."""
    function = partial(_derive_one, spec)
    for _ in as_batch(params)[0]:
        function = jax.vmap(function)
    return function(params)


@partial(pytrees.run_once, fixed=1)
def _derive_one(spec: settings.Fidelity, params: BipedParams) -> dict[str, Any]:
    """One program for every robot, payload and unit payload of a fidelity and a type."""
    return {
        "fitted": inertia_of(params, spec),
        "own_mass": params.total_mass,
        "step_length": step_length(params),
        "closes": least_closure(params, 256)[0] >= 0,
        "symmetric": links.exchange_mismatch(params) < links.MISMATCH,
    }


@pytrees.pytree_dataclass
class LoadedInertia(Inertia):
    """Inertia functions of a robot with other masses; they are linear in the masses.

    empty: of the robot itself. unit: of 1 kg at the hip's centre and nothing else.
    """

    empty: Inertia
    unit: Inertia | None
    load: Load

    def at(self, theta: Scalar) -> ReducedInertia | DifferencedInertia:
        return self._sum("at", theta)

    def moment_at(self, theta: Scalar) -> GroundMoment:
        return self._sum("moment_at", theta)

    def spin_at(self, theta: Scalar) -> tuple[Scalar, Scalar]:
        return self._sum("spin_at", theta)

    def _sum(self, part: str, theta: Scalar) -> Any:
        """Values of a method of the inertia functions."""
        values = getattr(self.empty, part)(theta)
        scaled = jax.tree.map(lambda value: self.load.mass_factor * value, values)
        if self.unit is None:
            return scaled
        unit = getattr(self.unit, part)(theta)
        return jax.tree.map(lambda a, b: a + self.load.payload * b, scaled, unit)


def load(
    model: BipedModel,
    unit: Inertia | None,
    mass_factor: pytrees.Numeric,
    payload: pytrees.Numeric = 0.0,
) -> BipedModel:
    """The model with every mass and inertia times `mass_factor`, and `payload` [kg] on the hip.

    Fits nothing again: the functions are sums (see LoadedInertia). unit: from
    `BipedModel.unit_inertia`, or None for no payload, and nothing compiled for it. model.params
    stays the robot without it. A load takes the place of one before.
    """
    extra = None if unit is None else jnp.asarray(payload)
    return pytrees.rebuilt(model, load=Load(jnp.asarray(mass_factor), extra), unit=unit)


def loaded_params(model: BipedModel) -> BipedParams:
    """The robot with all that it carries: the model's payload and the load of `load`."""
    params = model.params
    if model.load is None:
        return params
    factor, extra = model.load.mass_factor, model.load.payload
    mass, inertia = (factor * jnp.asarray(value) for value in (params.mass, params.inertia))
    payload = factor * params.payload + (0.0 if extra is None else extra)
    return replace(params, mass=mass, inertia=inertia, payload=payload)
