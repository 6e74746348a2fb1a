"""One's own walk at a setting, beside the event-exact walk.

`recommend` promises a share of walks of a population. What a single walk comes to, only that walk
can tell: `check_walk` runs it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.model import prepare
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.recommendation import setting_of
from stickslip.dynamics.biped.settings import EventExact, Setting, Table, precision
from stickslip.dynamics.biped.simulation import (
    DURATION,
    require_held,
    require_walk,
    simulate,
    steps_in,
)
from stickslip.dynamics.biped.state import BipedState
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.pytrees import require_one
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Float, Int
    from numpy.typing import ArrayLike

    from stickslip.dynamics.pytrees import Number, Numbers
    from stickslip.dynamics.scene import Scene

TIGHT = EventExact(rtol=1e-11, atol=1e-14)
"""The reference's integrator."""
FINE = Table(64, 9)
"""The reference's inertia functions: exact to 1e-13 on the default robot."""


@dataclass(frozen=True)
class WalkCheck:
    """A walk at a setting and event-exact; NumPy numbers.

    angle_error [rad], slide_error [m]: the largest difference at the ends of the torques' periods,
    as long as the reference stays inside the model; infinite where the setting's walk ends earlier.
    status, reference_status: the gravest Status of each.
    """

    setting: Setting
    angle_error: Float[np.ndarray, ""]
    slide_error: Float[np.ndarray, ""]
    status: Int[np.ndarray, ""]
    reference_status: Int[np.ndarray, ""]


class Path(NamedTuple):
    """A walk at the ends of the torques' periods [n]; its switches so far, where they count."""

    angle: Any
    slide: Any
    status: Any
    switches: Any = None


def check_walk(
    params: BipedParams,
    scene: Scene | str,
    state: BipedState,
    torque: Numbers | Callable[[BipedState], Number],
    duration: float,
    setting: str | Setting = "balanced",
    *,
    period: float | None = None,
) -> WalkCheck:
    """Walk at a setting and event-exact at 1e-11 in float64, and compare.

    params, scene, state, torque, duration [s]: as in `simulate`. torque: a number, [n] or a
    function of the state; setting: a name or a Setting. period: how long a torque is held [s]; by
    default duration / n where torques are given one by one, else setting.dt. Steps are setting.dt
    or shorter, a whole number in a period.

    JAX's precision switch stays as it is. Raises ValueError as `simulate` does, and for a prepared
    model.
    """
    setting = setting_of(setting)
    require_kind("params", params, BipedParams, "BipedParams: the setting prepares the robot")
    with precision("float64"):  # the robot may be in it whatever the switch says now
        scene, duration = require_walk(params, scene, state, duration)
    torques: Any = torque
    if period is None:
        period = setting.dt if np.ndim(torques) == 0 else duration / np.shape(torques)[0]
    period = require_one("period", period, low=0.0, strict=True, accepted=DURATION)
    count = steps_in(duration, period)
    if not callable(torque):
        require_held("torque", torque, count)

    walk = partial(_walked, params, scene, state, torque, duration, count)
    integrator = setting.integrator_over(duration / count)
    own = walk(replace(setting, integrator=integrator))
    truth = walk(Setting(FINE, TIGHT, setting.dt, "float64"))
    errors = walk_errors(own, truth)
    return WalkCheck(setting, *errors, own.status[-1], truth.status[-1])


def _walked(
    params: BipedParams,
    scene: Scene,
    state: BipedState,
    torque: Numbers | Callable[[BipedState], Number],
    duration: float,
    count: int,
    setting: Setting,
) -> Path:
    """The walk at a setting, in `count` calls."""
    law: Any = torque
    with precision(setting.dtype):
        numbers = jax.tree.map(np.asarray, (params, scene, None if callable(law) else law))
        params, scene, held = jax.tree.map(lambda of: jnp.asarray(of, setting.dtype), numbers)
        model = prepare(params, fidelity=setting.fidelity, payload=scene.payload)
        given = model, replace(scene, payload=None), state.astype(setting.dtype)
        law, size = law if held is None else held, duration / count
        walk = simulate(*given, law, duration, size, integrator=setting.integrator)
        states = jax.tree.map(lambda leaf: np.asarray(leaf)[1:], walk.states)
        status = np.maximum.accumulate(np.asarray(walk.contacts.status))
    return Path(states.phase + np.pi * states.steps, states.foot_position, status)


def walk_errors(own: Path, truth: Path) -> tuple[np.ndarray, np.ndarray]:
    """Largest differences of crank angle [rad] and slide [m] while the reference is inside.

    Infinite where `own` ends before it, or is no number; 0 where the reference never was inside.
    """
    inside, runs = (np.asarray(path.status) <= Status.SLIP_ONSET for path in (truth, own))

    def largest(mine: ArrayLike, true: ArrayLike) -> np.ndarray:
        off = np.abs(np.asarray(mine, np.float64) - np.asarray(true, np.float64))
        off = np.where(runs & np.isfinite(off), off, np.inf)
        return np.max(np.where(inside, off, 0.0), axis=-1)

    return largest(own.angle, truth.angle), largest(own.slide, truth.slide)
