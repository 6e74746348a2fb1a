"""One's own walk at a setting, beside the event-exact walk: error, sensitivity, cost.

`recommend` promises a share of walks of a population. What a single walk comes to, only that walk
can tell: `check_walk` runs it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.model import prepare
from stickslip.dynamics.biped.params import BipedParams, own_time
from stickslip.dynamics.biped.recommendation import setting_of
from stickslip.dynamics.biped.settings import EventExact, Integrator, Setting, Table, precision
from stickslip.dynamics.biped.simulation import (
    DURATION,
    require_held,
    require_walk,
    simulate,
    steps_in,
)
from stickslip.dynamics.biped.state import BipedState
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.numeric import require_one
from stickslip.dynamics.scene import Scene, Smoothed
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Bool, Float, Int
    from numpy.typing import ArrayLike

    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.settings import Fidelity
    from stickslip.dynamics.numeric import Number, Numbers, Numeric

SENSITIVE = 1e3
"""Amplification above which a walk is called sensitive."""
TIGHT = EventExact(rtol=1e-11, atol=1e-14)
"""The reference's integrator."""
LOOSE = EventExact(rtol=1e-9, atol=1e-12)
"""Integrator that checks the reference and is differentiated."""
FINE = Table(64, 9)
"""The reference's inertia functions: exact to 1e-13 on the default robot."""


@dataclass(frozen=True)
class WalkCheck:
    """A walk at a setting and event-exact; NumPy numbers.

    angle_error [rad], slide_error [m]: the largest difference at the ends of the torques' periods,
    as long as the reference stays inside the model; infinite where the setting's walk ends earlier.
    status, reference_status: the gravest Status of each.
    sensitivity [-]: how much the walk makes of a difference at its start, by derivatives through
    the event-exact walk; see `amplification`. Above SENSITIVE = 1e3 the walk is `sensitive`: any
    change, of the last digit of a mass, too, grows by so much, and no promise of `recommend` is
    worth much on it. NaN where the derivative did not come to an end.
    reference_angle_error, reference_slide_error: the reference beside one with a hundred times the
    tolerance, which bounds its own error unless both overlook an event.
    cost: seconds for each simulated second and walk, warm, waited for, without compiling and
    preparing the robot. duration: of the walk [s].
    """

    setting: Setting
    duration: float
    angle_error: Float[np.ndarray, ""]
    slide_error: Float[np.ndarray, ""]
    status: Int[np.ndarray, ""]
    reference_status: Int[np.ndarray, ""]
    sensitivity: Float[np.ndarray, ""]
    reference_angle_error: Float[np.ndarray, ""]
    reference_slide_error: Float[np.ndarray, ""]
    cost: float

    @property
    def sensitive(self) -> Bool[np.ndarray, ""]:
        """True if the walk amplifies a difference of the start by more than SENSITIVE."""
        return ~(self.sensitivity <= SENSITIVE)


class Options(NamedTuple):
    """Static part of a walk's program: torque function or None, seconds, periods, integrator."""

    policy: Callable[[BipedState], Number] | None
    duration: float
    periods: int
    integrator: Integrator


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
    """Walk at a setting and event-exact at 1e-11 in float64: error, sensitivity and cost.

    params, scene, state, torque, duration [s]: as in `simulate`. torque: a number, [n] or a
    function of the state; setting: a name or a Setting. period: how long a torque is held [s]; by
    default duration / n where torques are given one by one, else setting.dt. Steps are setting.dt
    or shorter, a whole number in a period. The cost is the median of three runs.

    JAX's precision switch stays as it is. What is compiled (three programs) is kept for walks of
    the same kind: same setting, function, period, duration and shapes. Raises ValueError as
    `simulate` does, and for a prepared model.
    """
    setting = setting_of(setting)
    require_kind("params", params, BipedParams, "BipedParams: the setting prepares the robot")
    with precision("float64"):  # the robot may be in it whatever the switch says now
        scene, duration = require_walk(params, scene, state, duration)
    policy = torque if callable(torque) else None
    values: Any = None if callable(torque) else torque
    if period is None:
        period = setting.dt if np.ndim(values) == 0 else duration / np.shape(values)[0]
    period = require_one("period", period, low=0.0, strict=True, accepted=DURATION)
    count = steps_in(duration, period)
    if policy is None:
        require_held("torque", values, count)
    options = Options(policy, duration, count, setting.integrator_over(duration / count))
    walk = params, scene, state, values
    own, cost = _timed(options, setting.dtype, _prepared(setting.fidelity, setting.dtype, *walk))
    exact = _prepared(FINE, "float64", *walk)
    with precision("float64"):
        truth = _run(options._replace(integrator=TIGHT), *exact)
        check, growth = _grown(options._replace(integrator=LOOSE), *exact)
    own, truth, check = jax.tree.map(np.asarray, (own, truth, check))
    errors = walk_errors(own, truth), walk_errors(check, truth)
    most = np.max(np.where(truth.status <= Status.SLIP_ONSET, growth, 0.0), axis=-1)
    return WalkCheck(
        setting=setting,
        duration=duration,
        angle_error=errors[0][0],
        slide_error=errors[0][1],
        status=own.status[-1],
        reference_status=truth.status[-1],
        sensitivity=np.where(check.status[-1] == Status.NOT_CONVERGED, np.nan, most),
        reference_angle_error=errors[1][0],
        reference_slide_error=errors[1][1],
        cost=cost / duration,
    )


def _prepared(fidelity: Fidelity, dtype: str, params: BipedParams, scene: Scene, state, torque):
    """Model, scene, state and torques in this precision."""
    with precision(dtype):
        given = params, scene, state, torque
        params, scene, numbers, values = jax.tree.map(
            lambda leaf: jnp.asarray(np.asarray(leaf), dtype), given
        )
        state = replace(numbers, steps=jnp.asarray(state.steps, jnp.int32))
        model = _model(fidelity, params, scene.payload)
        return model, replace(scene, payload=None), state, values


@partial(jax.jit, static_argnums=0)
def _model(fidelity: Fidelity, params: BipedParams, payload: Any) -> BipedModel:
    return prepare(params, fidelity=fidelity, payload=payload)


def _timed(options: Options, dtype: str, walk: tuple[Any, ...]) -> tuple[Path, float]:
    """The walk, and the median seconds of three warm runs."""

    def run():
        begun = time.perf_counter()
        found = jax.block_until_ready(_run(options, *walk))
        return found, time.perf_counter() - begun

    with precision(dtype):
        found, _ = run()
        return found, float(np.median([run()[1] for _ in range(3)]))


def _walk(options: Options, model: BipedModel, scene: Scene, state: BipedState, values) -> Path:
    policy, duration, count, integrator = options
    torque = jnp.broadcast_to(values, (count,)) if policy is None else policy
    size = duration / count
    walk = simulate(model, scene, state, torque, duration, size, integrator=integrator)
    angle, slide = walk.states.crank_angle[1:], jnp.asarray(walk.states.foot_position)[1:]
    return Path(angle, slide, jax.lax.cummax(walk.contacts.status))


_run = jax.jit(_walk, static_argnums=0)


@partial(jax.jit, static_argnums=0)
def _grown(
    options: Options, model: BipedModel, scene: Scene, state: BipedState, values
) -> tuple[Path, Float[Array, " n"]]:
    """The walk, and its sensitivity at every sample."""

    def walk(state: BipedState) -> Path:
        return _walk(options, model, scene, state, values)

    length, time = model.params.crank, own_time(model.params)
    return amplification(walk, state, length, time, isinstance(scene.floor, Smoothed))


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


def amplification(
    walk: Callable[[BipedState], Any],
    state: BipedState,
    length: Numeric,
    time: Numeric,
    slips_freely: bool = False,
) -> tuple[Any, Float[Array, " n"]]:
    """Result of `walk` from `state`, and the sensitivity at each of its samples [n].

    walk: gives a tuple with the crank's `angle` [rad] and the foot's `slide` [m] at n instants.
    length, time: the robot's own, crank [m] and sqrt(crank / gravity) [s]. The sensitivity is the
    largest singular value of the derivative of (crank angle, slide / length) by the initial (phase,
    crank rate times time, slide / length, foot velocity times time / length): how many times the
    worst small difference at the start has grown. Forward mode, through every switch. A foot at
    rest on dry friction stays at rest however little it is pushed, so there the velocity's column
    is left out (slips_freely: it is not).
    """
    velocity = jnp.asarray(state.foot_velocity)
    pushed = slips_freely | (velocity != 0)

    def shifted(by: Float[Array, " 4"]):
        start = replace(
            state,
            phase=state.phase + by[0],
            crank_rate=state.crank_rate + by[1] / time,
            foot_position=state.foot_position + by[2] * length,
            foot_velocity=jnp.where(pushed, velocity + by[3] * length / time, velocity),
        )
        path = walk(start)
        return (path.angle, path.slide / length), path

    nowhere = jnp.zeros(4, velocity.dtype)

    def along(direction: Float[Array, " 4"]):
        _, tangents, path = jax.jvp(shifted, (nowhere,), (direction,), has_aux=True)
        return tangents, path

    directions = jnp.eye(4, dtype=nowhere.dtype)
    (angle, slide), path = jax.vmap(along, out_axes=(0, None))(directions)
    one, other, both = (
        jnp.sum(x * y, axis=0) for x, y in ((angle, angle), (slide, slide), (angle, slide))
    )
    largest = (one + other) / 2 + jnp.hypot((one - other) / 2, both)  # of J J', two by two
    return path, jnp.sqrt(largest)
