"""Figs. 11 and 12: the torque that a constant crank speed needs, without slip."""

from __future__ import annotations

from functools import partial

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
from stickslip.paper.result import NOT_STATED, Claim, Columns, Result, Setting, verdict_of

SPEEDS = (1.0, 2.0, 3.0, 4.0, 5.0)
LOADS = (0.0, 5.0, 10.0, 15.0)
LOADED_SPEED = 3.0
"""The chapter does not say at which speed Fig. 12 is drawn; this is Fig. 17's [rad/s]."""
HARDLY = 0.1
"""Curves "hardly differ" if their largest gap is below this share of the curve's range [-]."""


def phases(samples: int) -> jax.Array:
    """Crank angles of the supporting leg over one step, ends included [samples + 1, rad]."""
    return jnp.linspace(SUPPORT_START, SUPPORT_END, samples + 1)


@partial(jax.jit, static_argnames="outputs")
def steady(params: BipedParams, crank_angles, crank_rate, outputs="forces") -> InverseDynamics:
    """Inverse dynamics at constant crank rate without slip (eq. 18), along an array of angles."""
    rate, still = jnp.asarray(crank_rate, crank_angles.dtype), jnp.zeros((), crank_angles.dtype)
    return jax.vmap(lambda angle: inverse_dynamics(params, angle, rate, still, outputs=outputs))(
        crank_angles
    )


@jax.jit
def poses(params: BipedParams, crank_angles) -> Kinematics:
    """Kinematics along an array of crank angles."""
    return jax.vmap(lambda angle: kinematics(params, angle))(crank_angles)


def peak_of(values: np.ndarray) -> tuple[float, float]:
    """Where along an even grid the greatest value is, from 0 to 1, and the value, both by the
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
    numbers = ", ".join(f"{100 * gap[w]:.0f} % at {w:g}" for w in SPEEDS)
    claims = [
        Claim(
            "below 3 rad/s the torque curves hardly differ",
            f"largest gap to the quasi-static curve, of its range ({span:.2f} N m): {numbers} "
            "rad/s",
            verdict_of(gap[2.0] < HARDLY, gap[1.0] < HARDLY),
            "the gap is M' w²/2, so it grows with the square of the speed; counted as hardly: "
            f"below {100 * HARDLY:.0f} %",
        ),
        Claim(
            "the same shape for each speed but 5 rad/s",
            "correlation with the quasi-static curve: "
            + ", ".join(f"{alike[w]:.3f} at {w:g}" for w in SPEEDS)
            + " rad/s; peak "
            + ", ".join(f"{peak:.2f} N m at {place:.2f} T" for place, peak in peaks.values()),
            verdict_of(
                all(alike[w] > 0.98 for w in SPEEDS[:3]) and alike[5.0] < 0.95,
                alike[5.0] == min(alike.values()),
            ),
            "the inertia's share has a shape of its own and grows with the square of the speed, so "
            "the shape changes steadily; no speed stands apart",
        ),
    ]

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
    curves = {
        load: np.asarray(steady(_loaded(params, load), angles, LOADED_SPEED).torque)
        for load in LOADS
    }
    bare = curves[0.0]
    span = float(np.ptp(bare))
    change = {m: float(np.max(np.abs(curves[m] - bare))) / span for m in LOADS[1:]}
    peak = {m: float(curves[m].max() / bare.max() - 1) for m in LOADS}
    heights = np.asarray(poses(params, angles).centres)[:, BODIES.index("13"), 1]
    mass, step = float(params.total_mass), float(step_length(params))
    columns = _columns(setting, {f"torque with {m:g} kg [N m]": c for m, c in curves.items()})
    claims = [
        Claim(
            "5, 10 and 15 kg on the hip change the motor's torque only slightly",
            "peak torque "
            + ", ".join(f"{100 * peak[m]:+.1f} % with {m:g} kg" for m in LOADS[1:])
            + f" (robot: {mass:.2f} kg); largest gap to the bare curve, of its range: "
            + ", ".join(f"{100 * change[m]:.0f}" for m in LOADS[1:])
            + f" %, at {LOADED_SPEED:g} rad/s",
            verdict_of(max(change.values()) < HARDLY, min(change.values()) < HARDLY),
            "the load's height hardly changes, see below; its speed does, around the exchange of "
            f"support, where the gap is largest. Counted as slightly: below {100 * HARDLY:.0f} %",
        ),
        Claim(
            "because the hip stays at almost the same level",
            f"the hip's centre moves {1e3 * np.ptp(heights):.2f} mm up and down in a step of "
            f"{1e3 * step:.0f} mm",
            verdict_of(np.ptp(heights) < 0.01 * step),
            "the Chebyshev linkage's nearly straight line, doubled by the pantograph",
        ),
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


def _loaded(params: BipedParams, load: float) -> BipedParams:
    return params.replace(payload=jnp.asarray(load, jnp.result_type(params.payload)))


def _share(setting: Setting) -> np.ndarray:
    return np.linspace(0.0, 1.0, setting.samples + 1)


def _columns(setting: Setting, curves: dict[str, np.ndarray]) -> Columns:
    return {"time / T [-]": _share(setting), **curves}


def _finish(axis, note: str) -> None:
    drawing.name_panel(axis, "motor torque [N m]", note, "time in steps, t / T")
    drawing.mark(axis, y=0.0)
    axis.set_xlim(0, 1)
