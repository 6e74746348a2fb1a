"""Fig. 15: what acts on the supporting foot, and its equations of motion, (29) and (30)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

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
from stickslip.paper.result import Claim, Result, Setting, by_construction, verdict_of
from stickslip.paper.torque import phases, poses, steady

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

RATE = 3.0
FOOT, TIBIA, BAR = "1", "2", "11"
ROUNDING = 1e-9
"""An equation holds if what is left over is below this share of the weight [-]."""
SCALE = 4e-4
"""Length of a force in the drawing [m/N]."""


class FootForces(NamedTuple):
    """Forces on the foot over a step, ground frame, each [n, 2] N; zmp [n] m from the ankle."""

    ground: np.ndarray
    tibia: np.ndarray
    bar: np.ndarray
    zmp: np.ndarray

    @property
    def by_label(self) -> dict[str, np.ndarray]:
        """The three forces by what they are called in figures."""
        return {
            "f01, ground on foot": self.ground,
            "tibia (2) on foot": self.tibia,
            "bar (11) on foot": self.bar,
        }


def forces(setting: Setting) -> Result:
    """Fig. 15."""
    params, angles = BipedParams.from_bars(), phases(setting.samples)
    setting.say("joint forces")
    on_foot = foot_forces(steady(params, angles, RATE, outputs="joints"))
    placed = poses(params, angles)
    bar_pin = np.asarray(placed.pins.ankle_bar)[:, 0]
    foot = BODIES.index(FOOT)
    mass, gravity = float(params.mass[foot]), float(params.gravity)
    weight = gravity * float(params.total_mass)
    linear, moment = residuals(on_foot, bar_pin, mass * gravity)
    share = np.linspace(0.0, 1.0, setting.samples + 1)
    columns = {
        "time / T [-]": share,
        **{
            f"{label} {axis} [N]": values[:, i]
            for label, values in on_foot.by_label.items()
            for i, axis in enumerate("xy")
        },
        "zero-moment point from the ankle [m]": on_foot.zmp,
    }
    claims = [*_equations(linear, moment, weight, on_foot.zmp), _pins(placed)]
    return Result({"": columns}, lambda: _draw(share, on_foot, bar_pin, params), claims)


def _equations(linear: float, moment: float, weight: float, zmp: np.ndarray) -> list[Claim]:
    return [
        Claim(
            "eq. (29): f01 - f12 - f112 = m1 a1, the foot at rest",
            f"largest residual {_below(linear)} N, of a weight of {weight:.1f} N, over a step at "
            f"{RATE:g} rad/s",
            by_construction(linear < ROUNDING * weight),
            "Newton's law for the foot, read with its second pin to link 11, not 12, and the y "
            "line with f01y first and m1 g on its right. The joint forces solve all bodies' "
            "equations, the ground's force comes apart from them from P and Y: the residual checks "
            "the two computations by each other, not the chapter",
        ),
        Claim(
            "eq. (30) gives the zero-moment point from the foot's joint forces",
            f"largest residual {_below(moment)} N m; the point moves from {zmp.min():.3f} to "
            f"{zmp.max():.3f} m from the ankle",
            by_construction(moment < ROUNDING * weight),
            "the foot's moments balance for any robot. The point is computed from the whole "
            "robot's angular momentum, without joint forces; the foot's own moments give the same "
            "one: again one computation checked by another",
        ),
    ]


def _pins(placed: Kinematics) -> Claim:
    """Claim about the bar on the foot's second pin: its other end must keep its distance."""
    far = reaches(placed)
    fits = [name for name, lengths in far.items() if np.ptp(lengths) < ROUNDING * lengths.max()]
    shown = "; ".join(
        f"to link {name}'s other end {1e3 * lengths.min():.1f} to {1e3 * lengths.max():.1f} mm"
        for name, lengths in far.items()
    )
    return Claim(
        "the foot is joined to links 2 and 12 (drawing, eq. 29)",
        f"over a step, from the foot's second pin {shown}",
        verdict_of("12" in fits),
        "a bar keeps its length. Link 11 is parallel to the tibia and so ends beside the knee; "
        "link 12 is parallel to the femur (eq. 9) and ends beside C",
    )


def reaches(placed: Kinematics) -> dict[str, np.ndarray]:
    """Distance of each bar's far end from the supporting foot's second pin [n, m].

    Link 11 is parallel to the tibia, link 12 to the femur (eq. 9). placed: of n crank angles.
    """
    pins = placed.pins
    foot, knee, C = (
        np.asarray(place)[:, 0] for place in (pins.ankle_bar, pins.knee_bar, pins.C_bar)
    )
    ends = {"11": knee, "12": C}
    return {name: np.linalg.norm(place - foot, axis=-1) for name, place in ends.items()}


def _below(residual: float) -> str:
    """Rounding residual, rounded up to a power of ten since machines differ."""
    return f"below {10 ** np.ceil(np.log10(max(residual, 1e-300))):.0e}"


def foot_forces(motion: InverseDynamics[Any]) -> FootForces:
    """Pick the foot's forces out of inverse dynamics with outputs="joints"."""
    joints = np.asarray(motion.joint_forces)
    ground = np.stack([np.asarray(motion.friction_force), np.asarray(motion.normal_force)], -1)
    return FootForces(
        ground, _on_foot(joints, TIBIA), _on_foot(joints, BAR), np.asarray(motion.zmp)
    )


def residuals(on_foot: FootForces, bar_pin: np.ndarray, weight: float) -> tuple[float, float]:
    """The largest |force| [N] and |moment about the ankle| [N m] left over on a foot at rest.

    The ankle is at ground level, is the tibia's pin and the foot's centre of mass, so neither the
    friction, nor the tibia, nor the foot's weight has a moment about it. bar_pin: link 11's pin
    from the ankle [n, 2] m. weight: of the foot [N].
    """
    sum_of = on_foot.ground + on_foot.tibia + on_foot.bar - np.array([0.0, weight])
    moment = on_foot.zmp * on_foot.ground[:, 1] + _cross(bar_pin, on_foot.bar)
    return float(np.abs(sum_of).max()), float(np.abs(moment).max())


def _on_foot(joints: np.ndarray, other: str) -> np.ndarray:
    """Force on the foot by another body, whichever way round it is listed [n, 2] N."""
    components = []
    for axis in "xy":
        if (FOOT, other, axis) in JOINT_FORCES:
            components.append(joints[:, JOINT_FORCES.index((FOOT, other, axis))])
        else:
            components.append(-joints[:, JOINT_FORCES.index((other, FOOT, axis))])
    return np.stack(components, -1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _draw(share: np.ndarray, on_foot: FootForces, bar_pin: np.ndarray, params: BipedParams):
    figure, axes = drawing.sheet(3, height=2.5)
    colours = (theme.HOLDS, theme.MOTOR, theme.SLIDES)
    for axis, i, name in zip(axes[:2, 0], (0, 1), ("horizontal", "vertical"), strict=True):
        for (label, values), colour in zip(on_foot.by_label.items(), colours, strict=True):
            axis.plot(share, values[:, i], color=colour, lw=1.4, label=label)
        drawing.name_panel(axis, f"{name} force on the foot [N]", f"constant {RATE:g} rad/s")
        axis.set_xlim(0, 1)
    axes[1, 0].set_xlabel("time in steps, t / T", fontsize=9, color=theme.MUTED)
    drawing.legend(axes[0, 0])
    _draw_foot(axes[2, 0], on_foot, bar_pin, params, len(share) // 2, colours)
    return figure


def _draw_foot(
    axis: Axes,
    on_foot: FootForces,
    bar_pin: np.ndarray,
    params: BipedParams,
    at: int,
    colours: Sequence[str],
) -> None:
    """The foot at one instant with the forces on it as arrows."""
    heel, toe = -float(params.heel), float(params.toe)
    axis.plot([heel, toe], [0, 0], color=theme.INK, lw=5, solid_capstyle="butt")
    ankle = np.zeros(2)
    places = (np.array([on_foot.zmp[at], 0.0]), ankle, bar_pin[at])
    sides = ("left", "right", "left")  # where the labels have room
    for place, (label, force), colour, side in zip(
        places, on_foot.by_label.items(), colours, sides, strict=True
    ):
        tip = place + SCALE * force[at]
        look: dict[str, Any] = {
            "arrowstyle": "-|>",
            "color": colour,
            "lw": 1.8,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        axis.annotate("", xy=tip, xytext=(place[0], place[1]), arrowprops=look)
        text = f"{label}: {np.hypot(*force[at]):.1f} N"
        shift = (6 if side == "left" else -6, 0)
        look = {"fontsize": 8.5, "color": colour, "va": "center", "ha": side}
        axis.annotate(text, tip, shift, textcoords="offset points", **look)
    axis.plot(*np.transpose([ankle, bar_pin[at]]), "o", color=theme.INK, ms=5)
    axis.set_aspect("equal")
    axis.set_xlim(heel * 1.1, toe * 1.1)
    axis.set_ylim(-0.065, 0.05)
    note = f"1 cm is {0.01 / SCALE:g} N; the ground's force at the zero-moment point"
    drawing.name_panel(axis, "the foot at mid-step [m]", note)
