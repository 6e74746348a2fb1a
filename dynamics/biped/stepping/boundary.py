"""Checks of a walk's arguments before tracing; traced values pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import exchange_mismatch
from stickslip.dynamics.biped.model import BipedModel
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.state import BipedState
from stickslip.dynamics.checks import is_concrete, require_kind, require_memory, shown
from stickslip.dynamics.numeric import require_numeric
from stickslip.dynamics.once import run_once
from stickslip.dynamics.scene import Grip, Scene, scene_of

if TYPE_CHECKING:
    from stickslip.dynamics.biped.stepping.integrators import Integrator
    from stickslip.dynamics.numeric import Number

_mismatch = run_once(exchange_mismatch)

TIME_STEP = "a finite time step > 0 [s]"


def require_kinds(params: object, scene: object, state: object) -> Scene:
    """The scene, built where it is a name, or ValueError for arguments of another kind, and for
    text and lists inside of them."""
    accepted = "a BipedParams, or a BipedModel from `prepare`"
    require_kind("params", params, (BipedParams, BipedModel), accepted)
    scene = scene_of(scene)
    require_kind("state", state, BipedState, "a BipedState")
    if isinstance(params, BipedParams):
        require_numeric(**vars(params))
    return scene.validate()


def require_scalars(params: BipedParams | BipedModel, **values: Number) -> None:
    """Raise ValueError for a batch where one robot or walk is meant."""
    crank = (params.params if isinstance(params, BipedModel) else params).crank
    for name, value in (values | {"params.crank": crank}).items():
        if np.shape(value):
            raise ValueError(
                f"{name} has shape {np.shape(value)}; accepted: one number (batch with vmap)"
            )


def require_room(duration: float, dt: Number, scene: Scene, spec: Integrator) -> None:
    """Raise ValueError for more steps than memory holds."""
    numbers = 24 + (68 if scene.outputs == "joints" else 0)
    numbers += 3 * spec.log_size if spec.record_events else 0
    require_memory(f"dt = {shown(dt)}", "steps", duration / float(dt), 8 * numbers)


def require_exchange(params: BipedParams | BipedModel, scene: Scene) -> None:
    """Raise ValueError if a linkage with an impact at the exchange is to walk on."""
    if isinstance(params, BipedModel) or scene.steps == "one" or not is_concrete(params):
        return
    if np.ndim(params.crank) > 0:
        return  # a batch: Status.NO_EXCHANGE tells the members apart
    with jax.ensure_compile_time_eval():  # a robot of plain numbers inside the caller's own jit
        mismatch = float(_mismatch(params))
    accepted = max(1e-6, 1e3 * float(jnp.finfo(jnp.result_type(params.crank)).eps))
    if not mismatch < accepted:
        raise ValueError(
            f"this linkage breaks the exchange of support: the other foot is off flat rest, or the "
            f"crank's centre off its axis, by {mismatch:.3g} (crank lengths or rad); "
            f"accepted: below {accepted:.1g}, or a scene with "
            'steps="one"'
        )


def require_rest_on_grip(scene: Scene, state: BipedState) -> None:
    """Raise ValueError for a foot that moves on a floor without slip."""
    if not isinstance(scene.floor, Grip) or not is_concrete(state):
        return
    if np.any(np.asarray(state.foot_velocity) != 0):
        raise ValueError(
            f"foot_velocity = {shown(state.foot_velocity)} on a grip floor; accepted: 0 [m/s]"
        )
