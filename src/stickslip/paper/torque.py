"""Figs. 11 and 12: the torque that a constant crank speed needs, without slip."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import (
    BODIES,
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    InverseDynamics,
    Kinematics,
    inverse_dynamics,
    kinematics,
    step_length,
)
from stickslip.paper import drawing
from stickslip.paper.result import (
    NOT_STATED,
    Claim,
    Columns,
    Result,
    Setting,
    share_of,
    verdict_of,
)

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real
    from matplotlib.axes import Axes

    from stickslip.dynamics.numeric import Number

SPEEDS = (1.0, 2.0, 3.0, 4.0, 5.0)
LOADS = (0.0, 5.0, 10.0, 15.0)
LOADED_SPEED = 3.0
"""The chapter does not say at which speed Fig. 12 is drawn; this is Fig. 17's [rad/s]."""
HARDLY = 0.1
"""Curves "hardly differ" if their largest gap is below this share of the curve's range [-]."""
ALIKE = 0.95
"""Curves have "the same shape" if their correlation is above this [-]."""
LEVEL = 0.01
"""The hip stays "at the same level" if it moves up and down by less than this share of a step."""


def phases(samples: int) -> jax.Array:
    """Crank angles of the supporting leg over one step, ends included [samples + 1, rad]."""
    return jnp.linspace(SUPPORT_START, SUPPORT_END, samples + 1)


@partial(jax.jit, static_argnames="outputs")
def steady(
    params: BipedParams,
    crank_angles: Float[Array, " n"],
    crank_rate: Real[Number, ""],
    outputs: Literal["forces", "joints"] = "forces",
) -> InverseDynamics[Any]:
    """Inverse dynamics at constant crank rate without slip (eq. 18), along an array of angles."""
    rate, still = jnp.asarray(crank_rate, crank_angles.dtype), jnp.zeros((), crank_angles.dtype)
    return jax.vmap(lambda angle: inverse_dynamics(params, angle, rate, still, outputs=outputs))(
        crank_angles
    )


@jax.jit
def poses(params: BipedParams, crank_angles: Float[Array, " n"]) -> Kinematics:
    """Kinematics along an array of crank angles."""
    return jax.vmap(lambda angle: kinematics(params, angle))(crank_angles)


def peak_of(values: np.ndarray) -> tuple[float, float]:
    """Position of the greatest value on an even grid, from 0 to 1, and the value, both by the
    parabola through it and its neighbours."""
    i, last = int(np.argmax(values)), len(values) - 1
    if i in (0, last):
        return i / last, float(values[i])
    before, at, after = values[i - 1 : i + 2]
    shift = (before - after) / (2 * (before - 2 * at + after))
    return (i + float(shift)) / last, float(at - (before - after) * shift / 4)


def speeds(setting: Setting) -> Result:
    """Fig. 11."""
    params, angles = BipedParams.from_bars(), phases(setting.samples)
    curves = {w: np.asarray(steady(params, angles, w).torque) for w in (0.0, *SPEEDS)}
    slow = curves[0.0]
    span = float(np.ptp(slow))
    gap = {w: float(np.max(np.abs(curves[w] - slow))) / span for w in SPEEDS}
    alike = {w: float(np.corrcoef(curves[w], slow)[0, 1]) for w in SPEEDS}
    peaks = {w: peak_of(curves[w]) for w in SPEEDS}
    columns = _columns(setting, {f"torque at {w:g} rad/s [N m]": c for w, c in curves.items()})
    claims = [_hardly(gap, span), _shape(alike, peaks)]

    def draw():
        figure, axes = drawing.sheet(height=3.8)
        chosen = [(f"{w:g} rad/s", curves[w]) for w in SPEEDS]
        drawing.family(axes[0, 0], _share(setting), chosen)
        _finish(axes[0, 0], "dashed: without inertia")
        axes[0, 0].plot(_share(setting), slow, color="k", lw=0.9, ls=drawing.DASH)
        return figure

    return Result({"": columns}, draw, claims)


def loads(setting: Setting) -> Result:
    """Fig. 12."""
    params, angles = BipedParams.from_bars(), phases(setting.samples)
    curves = _with_loads(params, angles, LOADED_SPEED)
    bare, change = curves[0.0], _gaps(curves)
    still = _gaps(_with_loads(params, angles, 0.0))
    peak = {m: peak_of(curves[m])[1] / peak_of(bare)[1] - 1 for m in LOADS[1:]}
    heights = np.asarray(poses(params, angles).centres)[:, BODIES.index("13"), 1]
    mass, step = float(params.total_mass), float(step_length(params))
    columns = _columns(setting, {f"torque with {m:g} kg [N m]": c for m, c in curves.items()})
    claims = [
        _slightly(peak, change, mass),
        _level(float(np.ptp(heights)), step, still),
        Claim(
            "the speed of Fig. 12",
            f"{LOADED_SPEED:g} rad/s taken",
            NOT_STATED,
            "the chapter gives none",
        ),
    ]

    def draw():
        figure, axes = drawing.sheet(height=3.8)
        drawing.family(axes[0, 0], _share(setting), [(f"{m:g} kg", c) for m, c in curves.items()])
        _finish(axes[0, 0], f"at {LOADED_SPEED:g} rad/s")
        return figure

    return Result({"": columns}, draw, claims)


def _hardly(gap: dict[float, float], span: float) -> Claim:
    """gap: to the curve without inertia over its range, by speed; span: the range [N m]."""
    numbers = ", ".join(f"{100 * share:.0f} % at {w:g}" for w, share in gap.items())
    slow = [share for w, share in gap.items() if w < 3]
    return Claim(
        "below 3 rad/s the torque curves hardly differ",
        f"largest gap to the quasi-static curve, of its range ({span:.2f} N m): {numbers} rad/s",
        share_of(share < HARDLY for share in slow),
        "the gap is M' w²/2, so it grows with the square of the speed; counted as hardly: below "
        f"{100 * HARDLY:.0f} %, at {_speeds(w for w in gap if w < 3)}. With a limit above "
        f"{100 * max(slow):.0f} % it would agree, with one below {100 * min(slow):.0f} % differ",
    )


def _shape(alike: dict[float, float], peaks: dict[float, tuple[float, float]]) -> Claim:
    """alike: correlation with the curve without inertia, by speed; peaks: place [T], value [N m].

    Correlation falls with the speed whatever the robot is, as the inertia's share grows.
    """
    *slower, fastest = alike.values()
    kept = [share > ALIKE for share in slower]
    whole, some = all(kept), any(kept)
    return Claim(
        "the same shape for each speed but 5 rad/s",
        "correlation with the quasi-static curve: "
        + ", ".join(f"{share:.3f} at {w:g}" for w, share in alike.items())
        + " rad/s; peak "
        + ", ".join(f"{peak:.2f} N m at {place:.2f} T" for place, peak in peaks.values()),
        verdict_of(whole and fastest <= ALIKE, whole or (some and fastest <= ALIKE)),
        "the inertia's share has a shape of its own and grows with the square of the speed, so the "
        f"shape changes steadily. Counted as the same: correlation above {ALIKE:g}. With a limit "
        f"from {fastest:.3f} to {min(slower):.3f} it would agree, from {max(slower):.3f} differ",
    )


def _slightly(peak: dict[float, float], change: dict[float, float], mass: float) -> Claim:
    """peak, change: of the torque by load, shares; mass: of the robot [kg]."""
    gaps = change.values()
    return Claim(
        "5, 10 and 15 kg on the hip change the motor's torque only slightly",
        "peak torque "
        + ", ".join(f"{100 * share:+.1f} % with {m:g} kg" for m, share in peak.items())
        + f" (robot: {mass:.2f} kg); largest gap to the bare curve, of its range: "
        + ", ".join(f"{100 * share:.0f}" for share in gaps)
        + f" %, at {LOADED_SPEED:g} rad/s",
        share_of(share < HARDLY for share in gaps),
        "the load's height hardly changes, see below; its speed does, around the exchange of "
        f"support, where the gap is largest. Counted as slightly: below {100 * HARDLY:.0f} %. With "
        f"a limit above {100 * max(gaps):.0f} % it would agree, with one below "
        f"{100 * min(gaps):.0f} % differ",
    )


def _level(height: float, step: float, still: dict[float, float]) -> Claim:
    """height: by which the hip moves up and down in a step [m]. still: change by load at rest."""
    load, share = list(still.items())[-1]
    level, so = height < LEVEL * step, share < HARDLY
    return Claim(
        "because the hip stays at almost the same level",
        f"the hip's centre moves {1e3 * height:.2f} mm up and down in a step of "
        f"{1e3 * step:.0f} mm; without inertia {load:g} kg change the torque by "
        f"{100 * share:.1f} % of its range",
        verdict_of(level and so, level or so),
        "the Chebyshev linkage's nearly straight line, doubled by the pantograph. Counted as "
        f"level: below {100 * LEVEL:.0f} % of a step; as the reason: below {100 * HARDLY:.0f} % "
        "without inertia. Partly: one of the two",
    )


def _with_loads(
    params: BipedParams, angles: jax.Array, crank_rate: float
) -> dict[float, np.ndarray]:
    return {
        load: np.asarray(steady(_loaded(params, load), angles, crank_rate).torque) for load in LOADS
    }


def _gaps(curves: dict[float, np.ndarray]) -> dict[float, float]:
    """Largest gap to the curve without load over its range, by load [-]."""
    bare = curves[0.0]
    return {m: float(np.max(np.abs(c - bare)) / np.ptp(bare)) for m, c in curves.items() if m}


def _speeds(values: Iterable[float]) -> str:
    return " and ".join(f"{w:g}" for w in values) + " rad/s"


def _loaded(params: BipedParams, load: float) -> BipedParams:
    return params.replace(payload=jnp.asarray(load, jnp.result_type(params.payload)))


def _share(setting: Setting) -> np.ndarray:
    return np.linspace(0.0, 1.0, setting.samples + 1)


def _columns(setting: Setting, curves: dict[str, np.ndarray]) -> Columns:
    return {"time / T [-]": _share(setting), **curves}


def _finish(axis: Axes, note: str) -> None:
    drawing.name_panel(axis, "motor torque [N m]", note, "time in steps, t / T")
    drawing.mark(axis, y=0.0)
    axis.set_xlim(0, 1)
