"""Fig. 15: what acts on the supporting foot, and its equations of motion, (29) and (30)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stickslip.dynamics.biped import (
    BODIES,
    JOINT_FORCES,
    BipedParams,
    InverseDynamics,
    Kinematics,
)
from stickslip.envs.rendering import theme
from stickslip.paper import drawing
from stickslip.paper.figure import Claim, Result, by_construction, verdict_of
from stickslip.paper.torque import phases, poses, steady

RATE = 3.0
FOOT, TIBIA, BAR = "1", "2", "11"
ROUNDING = 1e-9
"""An equation holds if its residual is below this share of the weight [-]."""
COLOURS = (theme.HOLDS, theme.MOTOR, theme.SLIDES)


class FootForces(NamedTuple):
    """Forces on the foot over a step, ground frame, each [n, 2] N; zmp [n] m from the ankle."""

    ground: np.ndarray
    tibia: np.ndarray
    bar: np.ndarray
    zmp: np.ndarray

    @property
    def by_label(self) -> dict[str, np.ndarray]:
        """The three forces by name."""
        labels = ("f01, ground on foot", "tibia (2) on foot", "bar (11) on foot")
        return dict(zip(labels, self[:3], strict=True))


def forces(samples: int) -> Result:
    """Fig. 15."""
    params, angles = BipedParams.from_bars(), phases(samples)
    on_foot = foot_forces(steady(params, angles, RATE, outputs="joints"))
    placed = poses(params, angles)
    bar_pin = np.asarray(placed.pins.ankle_bar)[:, 0]
    gravity = float(params.gravity)
    own = gravity * float(params.mass[BODIES.index(FOOT)])
    weight = gravity * float(params.total_mass)
    time = np.linspace(0.0, 1.0, samples + 1)
    columns = {
        f"{label} {axis} [N]": values[:, i]
        for label, values in on_foot.by_label.items()
        for i, axis in enumerate("xy")
    }
    columns = {"time / T [-]": time, **columns, "zero-moment point from the ankle [m]": on_foot.zmp}
    claims = [*equations(*residuals(on_foot, bar_pin, own), weight, on_foot.zmp), pinned(placed)]
    return Result({"": columns}, lambda: _draw(time, on_foot), claims)


def foot_forces(motion: InverseDynamics[Any]) -> FootForces:
    """Pick the foot's forces out of inverse dynamics with outputs="joints"."""
    joints = np.asarray(motion.joint_forces)

    def on_foot(other: str) -> np.ndarray:
        pairs = [((FOOT, other, axis), (other, FOOT, axis)) for axis in "xy"]
        columns = [
            joints[:, JOINT_FORCES.index(own)]
            if own in JOINT_FORCES
            else -joints[:, JOINT_FORCES.index(reaction)]
            for own, reaction in pairs
        ]
        return np.stack(columns, -1)

    ground = np.stack([np.asarray(motion.friction_force), np.asarray(motion.normal_force)], -1)
    return FootForces(ground, on_foot(TIBIA), on_foot(BAR), np.asarray(motion.zmp))


def residuals(on_foot: FootForces, bar_pin: np.ndarray, weight: float) -> tuple[float, float]:
    """Largest residual force [N] and moment about the ankle [N m] of a foot at rest.

    The ankle is at ground level, is the tibia's pin and the foot's centre of mass, so neither the
    friction, nor the tibia, nor the foot's weight has a moment about it. bar_pin: link 11's pin
    from the ankle [n, 2] m. weight: of the foot [N].
    """
    force = on_foot.ground + on_foot.tibia + on_foot.bar - np.array([0.0, weight])
    of_bar = bar_pin[:, 0] * on_foot.bar[:, 1] - bar_pin[:, 1] * on_foot.bar[:, 0]
    moment = on_foot.zmp * on_foot.ground[:, 1] + of_bar
    return float(np.abs(force).max()), float(np.abs(moment).max())


def equations(linear: float, moment: float, weight: float, zmp: np.ndarray) -> list[Claim]:
    """linear, moment: residuals of eqs. (29) and (30); weight: of the robot [N]; zmp [n, m]."""
    return [
        Claim(
            "eq. (29): f01 - f12 - f112 = m1 a1, the foot at rest",
            f"residual {_below(linear)} N of a weight of {weight:.1f} N, at {RATE:g} rad/s",
            by_construction(linear < ROUNDING * weight),
            "read with the second pin to link 11 and m1 g in the y line; joint forces and the "
            "ground's force come from two computations",
        ),
        Claim(
            "eq. (30) gives the zero-moment point from the foot's joint forces",
            f"residual {_below(moment)} N m; the point moves from {zmp.min():.3f} to "
            f"{zmp.max():.3f} m from the ankle",
            by_construction(moment < ROUNDING * weight),
            "the point is computed from the whole robot's angular momentum, without joint forces",
        ),
    ]


def pinned(placed: Kinematics) -> Claim:
    """A bar can hold the foot's second pin if its other end stays equally far away."""
    foot, *ends = (
        np.asarray(of)[:, 0]
        for of in (placed.pins.ankle_bar, placed.pins.knee_bar, placed.pins.C_bar)
    )
    far = {
        name: np.linalg.norm(end - foot, axis=-1)
        for name, end in zip(("11", "12"), ends, strict=True)
    }
    shown = "; ".join(
        f"to link {name}'s other end {1e3 * of.min():.1f} to {1e3 * of.max():.1f} mm"
        for name, of in far.items()
    )
    return Claim(
        "the foot is joined to links 2 and 12 (drawing, eq. 29)",
        f"over a step, from the foot's second pin {shown}",
        verdict_of(np.ptp(far["12"]) < ROUNDING * far["12"].max()),
        "a bar keeps its length: link 11 is parallel to the tibia, link 12 to the femur (eq. 9)",
    )


def _below(residual: float) -> str:
    """A power of ten above the residual: rounding differs from machine to machine."""
    return f"below {10 ** np.ceil(np.log10(max(residual, 1e-300))):.0e}"


def _draw(time: np.ndarray, on_foot: FootForces):
    figure, axes = drawing.sheet(3, height=2.2, sharex=True)
    curves: Mapping[str, np.ndarray] = on_foot.by_label
    for axis, i, name in zip(axes[:2, 0], (0, 1), ("horizontal", "vertical"), strict=True):
        for (label, values), colour in zip(curves.items(), COLOURS, strict=True):
            axis.plot(time, values[:, i], color=colour, lw=1.4, label=label)
        drawing.name_panel(axis, f"{name} force on the foot [N]", f"constant {RATE:g} rad/s")
    drawing.legend(axes[0, 0])
    axis = axes[2, 0]
    axis.plot(time, 1e3 * on_foot.zmp, color=theme.INK, lw=1.4)
    drawing.name_panel(axis, "zero-moment point from the ankle [mm]", "", "time in steps, t / T")
    axis.set_xlim(0, 1)
    return figure
