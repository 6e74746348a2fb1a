"""Figs. 11 and 12: the torque that a constant crank speed needs, without slip."""

from __future__ import annotations

from collections.abc import Mapping
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
from stickslip.paper.figure import Claim, Result, share_of, verdict_of

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

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
    """Place of the maximum along an even grid, from 0 to 1, and its value, both by the parabola
    through the largest value and its neighbours."""
    i, last = int(np.argmax(values)), len(values) - 1
    if i in (0, last):
        return i / last, float(values[i])
    before, at, after = values[i - 1 : i + 2]
    shift = (before - after) / (2 * (before - 2 * at + after))
    return (i + float(shift)) / last, float(at - (before - after) * shift / 4)


def speeds(samples: int) -> Result:
    """Fig. 11."""
    params, angles = BipedParams.from_bars(), phases(samples)
    curves = {w: np.asarray(steady(params, angles, w).torque) for w in (0.0, *SPEEDS)}
    slow = curves[0.0]
    gap = {w: float(np.max(np.abs(curves[w] - slow)) / np.ptp(slow)) for w in SPEEDS}
    alike = {w: float(np.corrcoef(curves[w], slow)[0, 1]) for w in SPEEDS}
    columns = {f"torque at {w:g} rad/s [N m]": curve for w, curve in curves.items()}
    named = {"quasi-static": slow} | {f"{w:g} rad/s": curves[w] for w in SPEEDS}
    return Result(
        {"": {"time / T [-]": _time(samples), **columns}},
        lambda: _draw(samples, named, "constant crank rate"),
        [hardly(gap), same_shape(alike)],
    )


def loads(samples: int) -> Result:
    """Fig. 12."""
    params, angles = BipedParams.from_bars(), phases(samples)
    curves, still = (_with_loads(params, angles, rate) for rate in (LOADED_SPEED, 0.0))
    rise = {m: peak_of(curves[m])[1] / peak_of(curves[0.0])[1] - 1 for m in LOADS[1:]}
    heights = np.asarray(poses(params, angles).centres)[:, BODIES.index("13"), 1]
    columns = {f"torque with {m:g} kg [N m]": curve for m, curve in curves.items()}
    named = {f"{m:g} kg": curve for m, curve in curves.items()}
    return Result(
        {"": {"time / T [-]": _time(samples), **columns}},
        lambda: _draw(samples, named, f"at {LOADED_SPEED:g} rad/s"),
        [
            slightly(rise, _gaps(curves), float(params.total_mass)),
            level(float(np.ptp(heights)), float(step_length(params)), _gaps(still)),
        ],
    )


def hardly(gap: Mapping[float, float]) -> Claim:
    """gap: largest distance to the quasi-static curve over its range, by speed."""
    return Claim(
        "below 3 rad/s the torque curves hardly differ",
        f"largest gap to the quasi-static curve, of its range: {_percent(gap)} rad/s",
        share_of(share < HARDLY for w, share in gap.items() if w < 3),
        f"the gap grows with the square of the speed; hardly: below {100 * HARDLY:.0f} %",
    )


def same_shape(alike: Mapping[float, float]) -> Claim:
    """alike: correlation with the quasi-static curve, by speed."""
    *slower, fastest = alike.values()
    kept = [share > ALIKE for share in slower]
    breaks = fastest <= ALIKE
    return Claim(
        "the same shape for each speed but 5 rad/s",
        "correlation with the quasi-static curve: "
        + ", ".join(f"{share:.3f} at {w:g}" for w, share in alike.items())
        + " rad/s",
        verdict_of(all(kept) and breaks, all(kept) or (any(kept) and breaks)),
        f"the shape changes steadily with the inertia's share; the same: above {ALIKE:g}",
    )


def slightly(rise: Mapping[float, float], gap: Mapping[float, float], mass: float) -> Claim:
    """rise, gap: of the peak torque and of the curve, by load [-]; mass: of the robot [kg]."""
    return Claim(
        "5, 10 and 15 kg on the hip change the motor's torque only slightly",
        f"at {LOADED_SPEED:g} rad/s peak torque "
        + ", ".join(f"{100 * share:+.1f} % with {m:g} kg" for m, share in rise.items())
        + f" (robot: {mass:.2f} kg); largest gap of the range: {_percent(gap)} kg",
        share_of(share < HARDLY for share in gap.values()),
        f"the load's speed changes at the exchange of support; slightly: below {100 * HARDLY:.0f} "
        "%. The speed is ours",
    )


def level(height: float, step: float, still: Mapping[float, float]) -> Claim:
    """height: by which the hip moves up and down in a step [m]. still: gap by load at rest."""
    load, share = list(still.items())[-1]
    flat, so = height < LEVEL * step, share < HARDLY
    return Claim(
        "because the hip stays at almost the same level",
        f"the hip moves {1e3 * height:.2f} mm up and down in a step of {1e3 * step:.0f} mm; "
        f"without inertia {load:g} kg change the torque by {100 * share:.1f} % of its range",
        verdict_of(flat and so, flat or so),
        f"level: below {100 * LEVEL:.0f} % of a step; the reason: below {100 * HARDLY:.0f} % "
        "without inertia; partly: one of the two",
    )


def _with_loads(
    params: BipedParams, angles: jax.Array, crank_rate: float
) -> dict[float, np.ndarray]:
    """Torque curves by load."""
    robots = {m: params.replace(payload=jnp.asarray(m, angles.dtype)) for m in LOADS}
    return {m: np.asarray(steady(one, angles, crank_rate).torque) for m, one in robots.items()}


def _gaps(curves: Mapping[float, np.ndarray]) -> dict[float, float]:
    """Largest distance to the curve without load over its range, by load [-]."""
    bare = curves[0.0]
    return {m: float(np.max(np.abs(c - bare)) / np.ptp(bare)) for m, c in curves.items() if m}


def _percent(shares: Mapping[float, float]) -> str:
    return ", ".join(f"{100 * share:.0f} % at {x:g}" for x, share in shares.items())


def _time(samples: int) -> np.ndarray:
    return np.linspace(0.0, 1.0, samples + 1)


def _draw(samples: int, curves: Mapping[str, np.ndarray], note: str):
    figure, axes = drawing.sheet(height=3.8)
    axis = axes[0, 0]
    drawing.family(axis, _time(samples), curves.items())
    drawing.name_panel(axis, "motor torque [N m]", note, "time in steps, t / T")
    drawing.mark(axis, y=0.0)
    axis.set_xlim(0, 1)
    return figure
