"""One's own walk at a setting, beside the event-exact walk: error, sensitivity, cost.

`recommend` promises a share of walks of a population. What a single walk comes to, only that walk
can tell: `check_walk` runs it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.simulation import require_exchange, require_rest_on_grip, simulate
from stickslip.dynamics.biped.state import BipedState
from stickslip.dynamics.biped.stepping.integrators import EventExact, Integrator
from stickslip.dynamics.biped.tables import Table
from stickslip.dynamics.biped.trade.check_batch import WalkBatch, gathered, precision, timed
from stickslip.dynamics.biped.trade.sensitivity import amplification
from stickslip.dynamics.biped.trade.setting import Setting, own_time
from stickslip.dynamics.biped.trade.settings import setting_of
from stickslip.dynamics.checks import require_integer, require_kind, require_number
from stickslip.dynamics.scene import Scene, Smoothed, scene_of
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Bool, Float, Int
    from numpy.typing import ArrayLike

    from stickslip.dynamics.biped.model import BipedModel, Fidelity
    from stickslip.dynamics.numeric import Number, Numbers

SENSITIVE = 1e3
"""Amplification above which a walk is called sensitive."""
TIGHT = EventExact(rtol=1e-11, atol=1e-14, record_events=True)
"""The reference's integrator."""
LOOSE = EventExact(rtol=1e-9, atol=1e-12)
"""Integrator that checks the reference and is differentiated."""
FINE = Table(64, 9)
"""The reference's inertia functions: exact to 1e-13 on the default robot."""


@dataclass(frozen=True)
class WalkCheck:
    """A walk, or a batch [*batch], at a setting and event-exact; NumPy arrays of one shape.

    angle_error [rad], slide_error [m]: the largest difference at the ends of the torques' periods,
    as long as the reference stays inside the model; infinite where the setting's walk ends earlier.
    status, reference_status: the gravest Status of each. first_difference: time of the first event
    that only one of them has, or of another kind [s]; infinite where they have the same.
    sensitivity [-]: how much the walk makes of a difference at its start, by derivatives through
    the event-exact walk; see `amplification`. Above SENSITIVE = 1e3 the walk is `sensitive`: any
    change, of the last digit of a mass, too, grows by so much, and no promise of `recommend` is
    worth much on it. NaN where the derivative did not come to an end.
    reference_angle_error, reference_slide_error: the reference beside one with a hundred times the
    tolerance, which bounds its own error unless both have missed an event.
    cost: seconds for each simulated second and walk, warm, waited for; compiling and preparing the
    robot apart. compile_seconds: how much longer the first run took. duration: of the walk [s].
    """

    setting: Setting
    duration: float
    angle_error: Float[np.ndarray, "*batch"]
    slide_error: Float[np.ndarray, "*batch"]
    status: Int[np.ndarray, "*batch"]
    reference_status: Int[np.ndarray, "*batch"]
    first_difference: Float[np.ndarray, "*batch"]
    sensitivity: Float[np.ndarray, "*batch"]
    reference_angle_error: Float[np.ndarray, "*batch"]
    reference_slide_error: Float[np.ndarray, "*batch"]
    cost: float
    compile_seconds: float

    @property
    def sensitive(self) -> Bool[np.ndarray, "*batch"]:
        """True if the walk amplifies a difference of the start by more than SENSITIVE."""
        return ~(self.sensitivity <= SENSITIVE)

    @property
    def reference_suffices(self) -> Bool[np.ndarray, "*batch"]:
        """True if the reference is known ten times better than the errors that it shows.

        Where it is not, the errors are no more than that: at most of the size of the reference's.
        """
        angle = self.reference_angle_error <= 0.1 * self.angle_error
        slide = self.reference_slide_error <= 0.1 * self.slide_error
        exact = (self.reference_slide_error == 0) & (self.slide_error == 0)
        return angle & (slide | exact)


class Options(NamedTuple):
    """Static part of a walk's program: torque function or None, seconds, periods, integrator."""

    policy: Callable[[BipedState], Number] | None
    duration: float
    periods: int
    integrator: Integrator


class Path(NamedTuple):
    """A walk at the ends of the torques' periods [n], and its events [n, events] or None."""

    angle: Any
    slide: Any
    status: Any
    times: Any
    kinds: Any


def check_walk(
    params: BipedParams,
    scene: Scene | str,
    state: BipedState,
    torque: Numbers | Callable[[BipedState], Number],
    duration: float,
    setting: str | Setting = "balanced",
    *,
    period: float | None = None,
    fidelity: Fidelity = FINE,
    repeats: int = 3,
) -> WalkCheck:
    """Walk at a setting and event-exact at 1e-11 in float64: error, sensitivity and cost.

    params, scene, state, torque, duration [s]: as in `simulate`. A batch: numbers of params, scene
    and state with one leading axis, torque [batch, n]; what has none is shared. torque: a number,
    [n] or a function of the state; setting: a name or a Setting. period: how long a torque is held
    [s]; by default duration / n where torques are given one by one, else setting.dt. Steps are
    setting.dt or shorter, a whole number in a period. fidelity: the reference's; "reduced" is exact
    and several times slower. repeats: timed runs; their median counts.

    JAX's precision switch stays as it is. What is compiled (three programs) is kept for walks of
    the same kind: same setting, function, period, duration and shapes. For the sensitivity members
    are walked one after the other, which takes the longest. Raises ValueError as `simulate` does,
    for a prepared model, and for batches that do not match.
    """
    setting = setting_of(setting)
    require_kind("params", params, BipedParams, "BipedParams: the setting prepares the robot")
    scene = scene_of(scene)
    require_kind("state", state, BipedState, "a BipedState")
    accepted = "a finite time > 0 [s]"
    require_number("duration", duration, low=0.0, strict=True, accepted=accepted)
    state.validate()
    require_rest_on_grip(scene, state)
    with precision("float64"):  # the robot may be in it whatever the switch says now
        require_exchange(params, scene)
    require_integer("repeats", repeats)
    if not callable(torque):
        accepted = "finite numbers [N m], or a function of the state"
        require_number("torque", torque, accepted=accepted)
    policy = torque if callable(torque) else None
    batch = gathered(params, scene, state, None if callable(torque) else torque)
    count = _periods(batch, duration, setting.dt if period is None else period, period is None)
    rough = replace(setting.integrator_over(duration / count), record_events=True)
    options = Options(policy, float(duration), count, rough)
    own = timed(batch.prepared(setting.fidelity, setting.dtype), _walk, options, repeats)
    exact = batch.prepared(fidelity, "float64")
    truth = exact.run(_walk, options._replace(integrator=TIGHT))
    check, growth = exact.run(_grown, options._replace(integrator=LOOSE), serial=True)
    return _compared(setting, float(duration), own, truth, check, growth)


def _periods(batch: WalkBatch, duration: float, period: float, free: bool) -> int:
    """Number of torques of the walk."""
    if free and batch.torques is not None:
        return batch.torques
    accepted = "a finite time > 0 [s]"
    require_number("period", period, low=0.0, strict=True, accepted=accepted)
    count = max(1, int(np.ceil(float(duration) / float(period) * (1 - 1e-9))))
    if batch.torques not in (None, count):
        raise ValueError(
            f"torque has {batch.torques} values; accepted: a number, a function of the state or "
            f"one for each of the {count} periods of {period:g} s"
        )
    return count


def _walk(
    options: Options,
    model: BipedModel,
    scene: Scene,
    state: BipedState,
    values,
) -> Path:
    """The walk of one member."""
    policy, duration, count, integrator = options
    walk = simulate(
        model,
        scene,
        state,
        policy if policy is not None else jnp.broadcast_to(values, (count,)),
        duration,
        duration / count,
        integrator=integrator,
    )
    events = walk.contacts.events
    angle, slide = walk.states.crank_angle[1:], jnp.asarray(walk.states.foot_position)[1:]
    status = jax.lax.cummax(walk.contacts.status)
    if events is None:
        return Path(angle, slide, status, None, None)
    began = jnp.concatenate([jnp.zeros(1, status.dtype), status[:-1]])
    running = (began <= Status.SLIP_ONSET)[:, None]
    kinds = jnp.where(running, events.kinds, EventKind.NONE)
    return Path(angle, slide, status, events.times, kinds)


def _grown(
    options: Options,
    model: BipedModel,
    scene: Scene,
    state: BipedState,
    values,
) -> tuple[Path, Float[Array, " n"]]:
    """The walk of one member, and its sensitivity at every sample."""

    def walk(state: BipedState) -> Path:
        return _walk(options, model, scene, state, values)

    length, time = model.params.crank, own_time(model.params)
    return amplification(walk, state, length, time, isinstance(scene.floor, Smoothed))


def _compared(
    setting: Setting,
    duration: float,
    ran: tuple[Path, float, float],
    truth: Path,
    check: Path,
    growth: Float[Array, "*batch n"],
) -> WalkCheck:
    own, cost, compiled = ran
    own, truth, check = jax.tree.map(np.asarray, (own, truth, check))
    angle, slide = walk_errors(own, truth)
    reference_angle, reference_slide = walk_errors(check, truth)
    inside = truth.status <= Status.SLIP_ONSET
    most = np.max(np.where(inside, growth, 0.0), axis=-1)
    return WalkCheck(
        setting=setting,
        duration=duration,
        angle_error=angle,
        slide_error=slide,
        status=own.status[..., -1],
        reference_status=truth.status[..., -1],
        first_difference=_first_difference(own, truth),
        sensitivity=np.where(check.status[..., -1] == Status.NOT_CONVERGED, np.nan, most),
        reference_angle_error=reference_angle,
        reference_slide_error=reference_slide,
        cost=cost / duration,
        compile_seconds=compiled,
    )


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


def _first_difference(own: Path, truth: Path) -> np.ndarray:
    """Time of the first event that the other walk has not, member by member [s]."""
    shape = np.shape(truth.kinds)[:-2]
    rows = [
        [np.reshape(np.asarray(leaf), (-1, np.prod(leaf.shape[-2:]))) for leaf in pair]
        for pair in ((own.times, own.kinds), (truth.times, truth.kinds))
    ]
    found = []
    for member in range(len(rows[0][0])):
        events = [_listed(times[member], kinds[member]) for times, kinds in rows]
        found.append(_parting(*events))
    return np.reshape(np.asarray(found), shape)


def _listed(times: np.ndarray, kinds: np.ndarray) -> list[tuple[float, int]]:
    used = kinds != EventKind.NONE
    return list(zip(times[used].tolist(), kinds[used].tolist(), strict=True))


def _parting(own: list[tuple[float, int]], truth: list[tuple[float, int]]) -> float:
    """Time of the first event of another kind, or that only one walk has [s]."""
    pairs = zip_longest(own, truth, fillvalue=(np.inf, None))
    return next((min(a, b) for (a, kind), (b, other) in pairs if kind != other), np.inf)
