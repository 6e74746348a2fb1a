"""Figs. 11 to 15: constant crank rates without slip; walks from rest under a constant torque."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.pictures.episodes import panel as curves
from stickslip.dynamics import biped
from stickslip.dynamics.pytrees import Number
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.optim.gait.footing import Footing, peak_of
from stickslip.paper.result import Result, each

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

SPEEDS = (1.0, 2.0, 3.0, 4.0, 5.0)
LOADS = (0.0, 5.0, 10.0, 15.0)
TIME = "time / T [-]"
"""T: duration of a step."""
RATE = 3.0
"""The chapter does not say at which speed Figs. 12 and 15 are drawn; this is Fig. 17's [rad/s]."""
FOOT, TIBIA, BAR = "1", "2", "11"


SIZES: dict[str, Callable[[biped.BipedParams], float]] = {
    "rate": lambda robot: 1 / float(biped.own_time(robot)),
    "mass": lambda robot: float(robot.total_mass),
    "torque": lambda robot: Footing.of(robot).start_torque,
}
"""A robot's own rate [rad/s], mass [kg] and torque [N m]."""


def alike(params: biped.BipedParams, of: str, *numbers: float) -> list[float]:
    """The chapter's numbers in proportion to the robot's own one of SIZES, to three digits."""
    factor = SIZES[of](params) / SIZES[of](biped.BipedParams.from_bars())
    return [float(f"{factor * number:.3g}") for number in numbers]


def phases(samples: int) -> jax.Array:
    """Crank angles of the supporting leg over one step, ends included [samples + 1, rad]."""
    return jnp.linspace(biped.SUPPORT_START, biped.SUPPORT_END, samples + 1)


@partial(jax.jit, static_argnames="outputs")
def steady(
    params: biped.BipedParams,
    crank_angles: Float[Array, " n"],
    crank_rate: Real[Number, ""],
    outputs: Literal["forces", "joints"] = "forces",
) -> biped.InverseDynamics:
    """Inverse dynamics at constant crank rate without slip (eq. 18), along an array of angles."""
    rate, still = jnp.asarray(crank_rate, crank_angles.dtype), jnp.zeros((), crank_angles.dtype)
    return jax.vmap(
        lambda angle: biped.inverse_dynamics(params, angle, rate, still, outputs=outputs)
    )(crank_angles)


@jax.jit
def poses(params: biped.BipedParams, crank_angles: Float[Array, " n"]) -> biped.Kinematics:
    """Kinematics along an array of crank angles."""
    return jax.vmap(lambda angle: biped.kinematics(params, angle))(crank_angles)


def speeds(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 11."""
    angles, rates = phases(samples), alike(params, "rate", *SPEEDS)
    torques = {w: np.asarray(steady(params, angles, w).torque) for w in (0.0, *rates)}
    slow = torques[0.0]
    gap = {w: float(np.max(np.abs(torques[w] - slow)) / np.ptp(slow)) for w in rates}
    like = {w: float(np.corrcoef(torques[w], slow)[0, 1]) for w in rates}
    named = {f"{w:g} rad/s": curve for w, curve in torques.items()}
    panel = curves("motor torque", "N m", named, (0.0,))
    about = "the quasi-static curve"
    measured = {
        "hardly": f"largest gap to {about}, of its range: {_percent(gap)} rad/s",
        "same_shape": f"correlation with {about}: {each('{:.3f} at {:g}', like)} rad/s",
    }
    return Result(TIME, np.linspace(0, 1, samples + 1), [panel], measured)


def loads(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 12."""
    angles, masses = phases(samples), alike(params, "mass", *LOADS)
    (speed,) = alike(params, "rate", RATE)
    loads = {m: jnp.asarray(params.payload + m, angles.dtype) for m in masses}
    robots = {m: params.replace(payload=one) for m, one in loads.items()}
    torques = {m: np.asarray(steady(one, angles, speed).torque) for m, one in robots.items()}
    still = {m: np.asarray(steady(one, angles, 0.0).torque) for m, one in robots.items()}
    peak = {m: peak_of(torque)[1] for m, torque in torques.items()}
    rise = each("{:+.1f} % with {:g} kg", {m: 100 * (peak[m] / peak[0.0] - 1) for m in masses[1:]})
    heights = np.asarray(poses(params, angles).centres)[:, biped.BODIES.index("13"), 1]
    load, share = list(_gaps(still).items())[-1]
    measured = {
        "slightly": f"at {speed:g} rad/s peak torque {rise} (robot: {float(params.total_mass):.2f} "
        f"kg); largest gap of the range: {_percent(_gaps(torques))} kg",
        "level": f"the hip moves {1e3 * float(np.ptp(heights)):.2f} mm up and down in a step of "
        f"{1e3 * float(biped.step_length(params)):.0f} mm; without inertia {load:g} kg change the "
        f"torque by {100 * share:.1f} % of its range",
    }
    named = {f"{m:g} kg": curve for m, curve in torques.items()}
    panel = curves("motor torque", "N m", named, (0.0,))
    return Result(TIME, np.linspace(0, 1, samples + 1), [panel], measured)


def _gaps(torques: Mapping[float, np.ndarray]) -> dict[float, float]:
    """Largest distance to the curve without load over its range, by load [-]."""
    bare = torques[0.0]
    return {m: float(np.max(np.abs(c - bare)) / np.ptp(bare)) for m, c in torques.items() if m}


def _percent(shares: Mapping[float, float]) -> str:
    return each("{:.0f} % at {:g}", {x: 100 * share for x, share in shares.items()})


def forces(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 15."""
    angles, (rate,) = phases(samples), alike(params, "rate", RATE)
    motion = steady(params, angles, rate, outputs="joints")
    on_foot, pins = foot_forces(motion), poses(params, angles).pins
    panels = [
        curves(f"{side} force on the foot", "N", {name: of[:, i] for name, of in on_foot.items()})
        for i, side in enumerate(("horizontal", "vertical"))
    ]
    zmp = np.asarray(motion.zmp)
    panels.append(curves("zero-moment point from the ankle", "m", {"point": zmp}))
    ends = {11: pins.knee_bar, 12: pins.C_bar}
    bars = {link: np.asarray(end - pins.ankle_bar)[:, 0] for link, end in ends.items()}
    far = {link: 1e3 * np.linalg.norm(bar, axis=-1) for link, bar in bars.items()}
    shown = "; ".join(
        f"to link {link}'s other end {of.min():.1f} to {of.max():.1f} mm"
        for link, of in far.items()
    )
    pinned = f"over a step, from the foot's second pin {shown}"
    return Result(TIME, np.linspace(0, 1, samples + 1), panels, {"pinned": pinned})


def foot_forces(motion: biped.InverseDynamics) -> Mapping[str, np.ndarray]:
    """Forces of the ground, the tibia and the bar on the foot, by name, each [n, 2] N in the ground
    frame. motion: with outputs="joints"."""
    joints = np.asarray(motion.joint_forces)

    def on_foot(other: str) -> np.ndarray:
        columns = []
        for axis in "xy":
            own, reaction = (FOOT, other, axis), (other, FOOT, axis)
            sign, name = (1.0, own) if own in biped.JOINT_FORCES else (-1.0, reaction)
            columns.append(sign * joints[:, biped.JOINT_FORCES.index(name)])
        return np.stack(columns, -1)

    return {
        "f01, ground on foot": np.stack([motion.friction_force, motion.normal_force], -1),
        "tibia (2) on foot": on_foot(TIBIA),
        "bar (11) on foot": on_foot(BAR),
    }


TORQUES = (0.70, 0.80, 0.84, 0.845, 0.90, 1.0, 1.2)
DURATION = 4.0
"""Seconds drawn."""
TORQUE = 1.0
WEIGHTS = (6.0, 7.0, 8.0, 9.0, 10.0, 10.5)
"""Total masses of Fig. 14 [kg]."""
SCENE = Scene.grip(outputs="state")


def torques(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 13."""
    drawn = alike(params, "torque", *TORQUES)
    walks = {torque: from_rest(params, torque, DURATION, samples) for torque in drawn}
    starts = [torque for torque, walk in walks.items() if np.isfinite(first_step(walk))]
    measured = (
        f"{Footing.of(params).start_torque:.4f} N m by the balance of work; of the walks drawn "
        f"those with {', '.join(f'{torque:g}' for torque in starts)} N m end the first step"
    )
    named = {f"{torque:g} N m": walk for torque, walk in walks.items()}
    return _result(named, {"starts_at": measured})


def weights(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 14, with all densities, so masses and moments of inertia, scaled alike."""
    own, walks, (torque,) = float(params.total_mass), {}, alike(params, "torque", TORQUE)
    for mass in alike(params, "mass", *WEIGHTS):
        factor, scaled = mass / own, ("mass", "inertia", "payload")
        denser = replace(params, **{name: getattr(params, name) * factor for name in scaled})
        walks[mass] = from_rest(denser, torque, DURATION, samples)
    step = {mass: first_step(walk) for mass, walk in walks.items()}
    ended = ", ".join(f"{t:.3f} s ({mass:g} kg)" for mass, t in step.items() if np.isfinite(t))
    least = Footing.of(params).start_torque
    measured = (
        f"first step in {ended}; walks up to {own * torque / least:.2f} kg = {own:.2f} kg x "
        f"{torque:g} N m / {least:.4f} N m"
    )
    return _result({f"{mass:g} kg": walk for mass, walk in walks.items()}, {"heavier": measured})


def from_rest(
    params: biped.BipedParams, torque: float, duration: float, samples: int
) -> biped.Trajectory:
    """A constant torque [N m] for `duration` [s] in 4 x samples steps, from rest at pi/2; no slip,
    no toppling."""
    step = duration / (4 * samples)
    return biped.simulate(params, SCENE, biped.BipedState(), torque, duration, step)


def first_step(walk: biped.Trajectory) -> float:
    """End of the first step [s], interpolated between samples; infinite if it does not end."""
    farthest = np.fmax.accumulate(np.asarray(walk.states.crank_angle))
    return float(np.interp(3 * np.pi / 2, farthest, walk.states.time, right=np.inf))


def _result(walks: Mapping[str, biped.Trajectory], measured: dict[str, str]) -> Result:
    """Crank angles by name, NaN after the walk has left the model."""
    angles = {}
    for name, walk in walks.items():
        angles[name] = np.array(walk.states.crank_angle)
        angles[name][1:][np.asarray(walk.contacts.status) > Status.SLIP_ONSET] = np.nan
    time = DURATION * np.linspace(0, 1, len(next(iter(angles.values()))))
    return Result("time [s]", time, [curves("crank angle", "rad", angles, (np.pi / 2,))], measured)
