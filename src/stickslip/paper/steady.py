"""Figs. 11, 12 and 15: torque and forces on the foot at a constant crank rate, without slip."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Literal

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import (
    BODIES,
    JOINT_FORCES,
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    InverseDynamics,
    Kinematics,
    inverse_dynamics,
    kinematics,
    own_time,
    step_length,
)
from stickslip.optim.gait.footing import peak_of
from stickslip.optim.gait.gait import friction_uses
from stickslip.paper.result import (
    Claim,
    Result,
    claim,
    curves,
    each,
)

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.pytrees import Number

SPEEDS = (1.0, 2.0, 3.0, 4.0, 5.0)
LOADS = (0.0, 5.0, 10.0, 15.0)
TIME = "time / T [-]"
"""T: duration of a step."""
RATE = 3.0
"""The chapter does not say at which speed Figs. 12 and 15 are drawn; this is Fig. 17's [rad/s]."""
FOOT, TIBIA, BAR = "1", "2", "11"


def alike_rates(params: BipedParams, *rates: float) -> list[float]:
    """The chapter's rates in the robot's own unit of time [rad/s], to three digits."""
    factor = float(own_time(BipedParams.from_bars()) / own_time(params))
    return [_rounded(factor * rate) for rate in rates]


def alike_masses(params: BipedParams, *masses: float) -> list[float]:
    """The chapter's masses in proportion to the robot's [kg], to three digits."""
    factor = float(params.total_mass / BipedParams.from_bars().total_mass)
    return [_rounded(factor * mass) for mass in masses]


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def phases(samples: int) -> jax.Array:
    """Crank angles of the supporting leg over one step, ends included [samples + 1, rad]."""
    return jnp.linspace(SUPPORT_START, SUPPORT_END, samples + 1)


@partial(jax.jit, static_argnames="outputs")
def steady(
    params: BipedParams,
    crank_angles: Float[Array, " n"],
    crank_rate: Real[Number, ""],
    outputs: Literal["forces", "joints"] = "forces",
) -> InverseDynamics:
    """Inverse dynamics at constant crank rate without slip (eq. 18), along an array of angles."""
    rate, still = jnp.asarray(crank_rate, crank_angles.dtype), jnp.zeros((), crank_angles.dtype)
    return jax.vmap(lambda angle: inverse_dynamics(params, angle, rate, still, outputs=outputs))(
        crank_angles
    )


def friction_use(motion: InverseDynamics) -> np.ndarray:
    """|F| / N along a motion without slip [n]: the friction that rest needs; inf where N <= 0."""
    forces = np.asarray(motion.friction_force), np.asarray(motion.normal_force)
    return np.asarray(friction_uses(*forces))


@jax.jit
def poses(params: BipedParams, crank_angles: Float[Array, " n"]) -> Kinematics:
    """Kinematics along an array of crank angles."""
    return jax.vmap(lambda angle: kinematics(params, angle))(crank_angles)


def speeds(params: BipedParams, samples: int) -> Result:
    """Fig. 11."""
    angles, rates = phases(samples), alike_rates(params, *SPEEDS)
    torques = {w: np.asarray(steady(params, angles, w).torque) for w in (0.0, *rates)}
    slow = torques[0.0]
    gap = {w: float(np.max(np.abs(torques[w] - slow)) / np.ptp(slow)) for w in rates}
    alike = {w: float(np.corrcoef(torques[w], slow)[0, 1]) for w in rates}
    named = {f"{w:g} rad/s": curve for w, curve in torques.items()}
    panel = curves("motor torque", "N m", named, (0.0,))
    return Result(TIME, _time(samples), [panel], [hardly(gap), same_shape(alike)])


def loads(params: BipedParams, samples: int) -> Result:
    """Fig. 12."""
    angles, masses, (speed,) = (
        phases(samples),
        alike_masses(params, *LOADS),
        alike_rates(params, RATE),
    )
    loads = {m: jnp.asarray(params.payload + m, angles.dtype) for m in masses}
    robots = {m: params.replace(payload=one) for m, one in loads.items()}
    torques, still = (
        {m: np.asarray(steady(one, angles, rate).torque) for m, one in robots.items()}
        for rate in (speed, 0.0)
    )
    rise = {m: peak_of(torques[m])[1] / peak_of(torques[0.0])[1] - 1 for m in masses[1:]}
    heights = np.asarray(poses(params, angles).centres)[:, BODIES.index("13"), 1]
    step, mass = float(step_length(params)), float(params.total_mass)
    claims = [
        slightly(rise, _gaps(torques), mass, speed),
        level(float(np.ptp(heights)), step, _gaps(still)),
    ]
    named = {f"{m:g} kg": curve for m, curve in torques.items()}
    panel = curves("motor torque", "N m", named, (0.0,))
    return Result(TIME, _time(samples), [panel], claims)


def hardly(gap: Mapping[float, float]) -> Claim:
    """gap: largest distance to the quasi-static curve over its range, by speed."""
    measured = f"largest gap to the quasi-static curve, of its range: {_percent(gap)} rad/s"
    return claim("fig11", "hardly", measured)


def same_shape(alike: Mapping[float, float]) -> Claim:
    """alike: correlation with the quasi-static curve, by speed."""
    shown = each("{:.3f} at {:g}", alike)
    return claim("fig11", "same_shape", f"correlation with the quasi-static curve: {shown} rad/s")


def slightly(
    rise: Mapping[float, float], gap: Mapping[float, float], mass: float, rate: float
) -> Claim:
    """rise, gap: of the peak torque and of the curve, by load [-]; mass: of the robot [kg]."""
    shown = each("{:+.1f} % with {:g} kg", {m: 100 * share for m, share in rise.items()})
    measured = (
        f"at {rate:g} rad/s peak torque {shown} (robot: {mass:.2f} kg); largest gap of the range: "
        f"{_percent(gap)} kg"
    )
    return claim("fig12", "slightly", measured)


def level(height: float, step: float, still: Mapping[float, float]) -> Claim:
    """height: by which the hip moves up and down in a step [m]. still: gap by load at rest."""
    load, share = list(still.items())[-1]
    measured = (
        f"the hip moves {1e3 * height:.2f} mm up and down in a step of {1e3 * step:.0f} mm; "
        f"without inertia {load:g} kg change the torque by {100 * share:.1f} % of its range"
    )
    return claim("fig12", "level", measured)


def _gaps(torques: Mapping[float, np.ndarray]) -> dict[float, float]:
    """Largest distance to the curve without load over its range, by load [-]."""
    bare = torques[0.0]
    return {m: float(np.max(np.abs(c - bare)) / np.ptp(bare)) for m, c in torques.items() if m}


def _percent(shares: Mapping[float, float]) -> str:
    return each("{:.0f} % at {:g}", {x: 100 * share for x, share in shares.items()})


def _time(samples: int) -> np.ndarray:
    return np.linspace(0.0, 1.0, samples + 1)


Forces = Mapping[str, np.ndarray]
"""Of the ground, the tibia and the bar on the foot, by name, each [n, 2] N in the ground frame."""


def forces(params: BipedParams, samples: int) -> Result:
    """Fig. 15."""
    angles, (rate,) = phases(samples), alike_rates(params, RATE)
    motion = steady(params, angles, rate, outputs="joints")
    on_foot, zmp, placed = foot_forces(motion), np.asarray(motion.zmp), poses(params, angles)
    bar_pin = np.asarray(placed.pins.ankle_bar)[:, 0]
    gravity = float(params.gravity)
    own = gravity * float(params.mass[BODIES.index(FOOT)])
    panels = [
        curves(f"{side} force on the foot", "N", {name: of[:, i] for name, of in on_foot.items()})
        for i, side in enumerate(("horizontal", "vertical"))
    ]
    panels.append(curves("zero-moment point from the ankle", "m", {"point": zmp}))
    weight = gravity * float(params.total_mass)
    off = residuals(on_foot, zmp, bar_pin, own)
    claims = [*equations(*off, weight, zmp, rate), pinned(placed)]
    return Result(TIME, _time(samples), panels, claims)


def foot_forces(motion: InverseDynamics) -> Forces:
    """Pick the foot's forces out of inverse dynamics with outputs="joints"."""
    joints = np.asarray(motion.joint_forces)

    def on_foot(other: str) -> np.ndarray:
        columns = []
        for axis in "xy":
            own, reaction = (FOOT, other, axis), (other, FOOT, axis)
            sign, name = (1.0, own) if own in JOINT_FORCES else (-1.0, reaction)
            columns.append(sign * joints[:, JOINT_FORCES.index(name)])
        return np.stack(columns, -1)

    return {
        "f01, ground on foot": np.stack([motion.friction_force, motion.normal_force], -1),
        "tibia (2) on foot": on_foot(TIBIA),
        "bar (11) on foot": on_foot(BAR),
    }


def residuals(
    on_foot: Forces, zmp: np.ndarray, bar_pin: np.ndarray, weight: float
) -> tuple[float, float]:
    """Largest residual force [N] and moment about the ankle [N m] of a foot at rest.

    The ankle is at ground level, is the tibia's pin and the foot's centre of mass, so neither the
    friction, nor the tibia, nor the foot's weight has a moment about it. zmp [n] and bar_pin, link
    11's pin [n, 2]: from the ankle [m]. weight: of the foot [N].
    """
    ground, _, bar = on_foot.values()
    force = sum(on_foot.values()) - np.array([0.0, weight])
    moment = zmp * ground[:, 1] + bar_pin[:, 0] * bar[:, 1] - bar_pin[:, 1] * bar[:, 0]
    return float(np.abs(force).max()), float(np.abs(moment).max())


def equations(
    linear: float, moment: float, weight: float, zmp: np.ndarray, rate: float
) -> list[Claim]:
    """linear, moment: residuals of eqs. (29) and (30); weight: of the robot [N]; zmp [n, m]."""
    force = f"residual {_below(linear)} N of a weight of {weight:.1f} N, at {rate:g} rad/s"
    about = (
        f"residual {_below(moment)} N m; the point moves from {zmp.min():.3f} to "
        f"{zmp.max():.3f} m from the ankle"
    )
    return [claim("fig15", "forces", force), claim("fig15", "moment", about)]


def pinned(placed: Kinematics) -> Claim:
    """A bar can hold the foot's second pin if its other end stays equally far away."""
    foot, *ends = (
        np.asarray(of)[:, 0]
        for of in (placed.pins.ankle_bar, placed.pins.knee_bar, placed.pins.C_bar)
    )
    far = {
        link: np.linalg.norm(end - foot, axis=-1) for link, end in zip((11, 12), ends, strict=True)
    }
    shown = "; ".join(
        f"to link {link}'s other end {1e3 * of.min():.1f} to {1e3 * of.max():.1f} mm"
        for link, of in far.items()
    )
    return claim("fig15", "pinned", f"over a step, from the foot's second pin {shown}")


def _below(residual: float) -> str:
    """A bound in powers of ten: the rounding differs from machine to machine."""
    return f"below {10 ** np.ceil(np.log10(max(residual, 1e-300))):.0e}"
