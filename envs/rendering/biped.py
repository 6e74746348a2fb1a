"""The biped in pictures: the frame that is shown, its drawing, and its renderer."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.dynamics.scene import Grip, Patches, Smoothed, Uniform
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Drawing, GroundContact, Part, Stretch
from stickslip.envs.rendering.linkage import BARS, SOLE, Mechanism, plain
from stickslip.envs.rendering.scene import Readout, Renderer
from stickslip.envs.rendering.theme import brief, written

if TYPE_CHECKING:
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.scene import Scene
    from stickslip.envs.rendering.linkage import Pose

Numbers: TypeAlias = Any
"""A number, or an array [n] of NumPy."""
FAR = 1e4
"""End of the outermost patches in the picture [m]."""
WEIGHT_LENGTH, CONE_LENGTH = 0.26, 0.36
"""Length of the arrow of the weight, and of friction cones, in robot heights."""
LEAST_SLIDE = 1e-5
"""A slide shorter than this leaves no mark [m]."""
KEPT_MARKS = 2000
LEGEND = (
    ("main", "supporting leg"),
    ("pale-main", "swinging leg"),
    ("hip-edge", "hip with its slot"),
    ("motor", "crank and motor"),
    ("holds", "foot sticks: ground force, cone"),
    ("slides", "foot slips; dashed: kinetic cone;"),
    ("slides", "on the floor: how far"),
)
OWN = ("E", "ankle_bar", "H", "K", "knee_bar", "C", "F", "C_bar", "slot_pin", "rod_pin")
"""Pins of one leg."""


def stretches_of(scene: Scene) -> tuple[Stretch, ...]:
    """The floor from left to right."""
    kind = scene.floor
    if isinstance(kind, Grip):
        return (_stretch(-FAR, FAR, None, None),)
    if isinstance(kind, Smoothed):
        kind = Uniform(kind.mu_kinetic, kind.mu_kinetic)
    edges = np.asarray(kind.edges, float) if isinstance(kind, Patches) else np.empty(0)
    static, kinetic = (np.asarray(mu, float) for mu in (kind.mu_static, kind.mu_kinetic))
    if edges.ndim > 1 or static.ndim > (1 if isinstance(kind, Patches) else 0):
        raise ValueError(
            "scene holds a batch of floors; accepted: one floor, for instance "
            "jax.tree.map(lambda leaf: leaf[0], scene)"
        )
    ends = pairwise([-FAR, *np.clip(edges, -FAR, FAR).tolist(), FAR])
    mus = (np.broadcast_to(mu, len(edges) + 1).tolist() for mu in (static, kinetic))
    return tuple(_stretch(*at, *mu) for at, mu in zip(ends, zip(*mus, strict=True), strict=True))


def _stretch(start: float, end: float, static: float | None, kinetic: float | None) -> Stretch:
    """Floor from start to end [m] with its friction coefficients, None where nothing can slip."""
    if static is None or kinetic is None:
        words = "no slip"
    elif static == kinetic:
        words = f"μ {static:.3g}"
    else:
        words = f"μₛ {static:.3g}   μₖ {kinetic:.3g}"
    colour = theme.hexadecimal(theme.floor_colour(static))
    return Stretch(start, end, colour, words)


@dataclass(frozen=True)
class BipedFrame:
    """PASIBOT's walk at one instant, or at n in a row (numbers [n]). Only positions follow from it.

    phase: crank angle of the supporting leg [rad]. steps: exchanges of support so far.
    floor_position: of the supporting ankle [m]. slide: of the feet since the start, forwards
    positive [m]. crank_rate [rad/s]. time [s]. torque: of the motor on the crank [N m].
    friction_force, normal_force: of the ground on the foot, forwards and upwards [N]. zmp:
    zero-moment point before the supporting ankle [m]. mu_static, mu_kinetic: friction under the
    foot [-], NaN where it cannot slip. sticking: whether the foot holds. mean_crank_rate: over the
    walk or the last step; commanded_rate: NaN for none [rad/s]. status: "ok", or cause of the
    walk's end. floor: of the episode, and weight: of the robot in it [N]; None for those that the
    renderer was made for. walked: by the centre of mass since the episode's start [m]; NaN: that of
    the hip since the first step's start is shown.
    """

    phase: Numbers
    steps: Numbers = 0
    floor_position: Numbers = 0.0
    slide: Numbers = 0.0
    crank_rate: Numbers = 0.0
    time: Numbers = 0.0
    torque: Numbers = 0.0
    friction_force: Numbers = 0.0
    normal_force: Numbers = 0.0
    zmp: Numbers = 0.0
    mu_static: Numbers = np.nan
    mu_kinetic: Numbers = np.nan
    sticking: Numbers = True
    mean_crank_rate: Numbers = 0.0
    commanded_rate: Numbers = np.nan
    status: str = "ok"
    floor: tuple[Stretch, ...] | None = None
    weight: float | None = None
    walked: Numbers = np.nan

    def rows(self) -> BipedFrame:
        """The same with every number an array [n]; 0 for what is not finite, but where NaN says
        something: a walk whose numbers overflow has a last picture, too."""
        names = [one.name for one in fields(self) if one.name not in ("status", "floor", "weight")]
        columns = np.broadcast_arrays(*(np.atleast_1d(getattr(self, name)) for name in names))
        found = dict(zip(names, columns, strict=True))
        for name in {*names} - {"mu_static", "mu_kinetic", "commanded_rate", "walked"}:
            found[name] = np.nan_to_num(found[name], posinf=0.0, neginf=0.0)
        return replace(self, **found)


class SlipMarks:
    """Slides of the supporting foot so far: a row for each frame in which it slid."""

    def __init__(self, most: int | None = KEPT_MARKS):
        self._rows: deque[list[float]] = deque(maxlen=most)
        self._slide: float | None = None
        self._whole = (-1, 0.0, 0.0)  # steps before the present slide, from where to where [m]

    def record(self, frames: BipedFrame) -> None:
        """Add what the foot slid in each row since the one before."""
        for sample, (slide, here, now) in enumerate(
            zip(frames.slide, frames.floor_position, frames.steps, strict=True)
        ):
            slid = 0.0 if self._slide is None else slide - self._slide
            self._slide = slide
            if abs(slid) < LEAST_SLIDE:
                continue
            low, high = min(here, here - slid), max(here, here - slid)
            steps, start, end = self._whole
            goes_on = low <= end + LEAST_SLIDE and high >= start - LEAST_SLIDE
            if self._rows and steps == now and goes_on:
                self._rows[-1][3] = np.nan
                start, end = min(low, start), max(high, end)
            else:
                start, end = low, high
            self._whole = now, start, end
            self._rows.append([sample, low, high, end - start])

    def rows(self) -> np.ndarray:
        """See Drawing.marks [m, 4]."""
        return np.array(self._rows, float).reshape(-1, 4)


class BipedSketch:
    """Makes drawings of one robot in one scene; a frame may bring its own floor and weight."""

    def __init__(self, params: BipedParams, scene: Scene):
        self.mechanism = Mechanism(params)
        self._floor = stretches_of(scene)
        mass = plain(params.total_mass) + (0.0 if scene.payload is None else plain(scene.payload))
        self._weight = mass * plain(params.gravity)
        self._surface = -SOLE * self.mechanism.crank

    def drawing(
        self, frames: BipedFrame, marks: np.ndarray, slips: np.ndarray | None = None
    ) -> Drawing:
        """The drawing of the frame's rows. slips: by default where the foot does not stick [n];
        marks: see Drawing."""
        frames = frames.rows()
        slips = ~np.asarray(frames.sticking, bool) if slips is None else slips
        poses = self.mechanism.poses(frames.phase % (2 * pi))
        leg = frames.steps % 2
        points, names = _points(poses, frames.floor_position, leg)
        tall = self.mechanism.top - self._surface
        return Drawing(
            points=points,
            bodies=_bodies(poses, points, names, leg),
            parts=_parts(self.mechanism, names),
            contacts=tuple(_contact(frames, leg == k, self._surface, slips) for k in (0, 1)),
            ground=np.array([[-FAR, self._surface], [FAR, self._surface]]),
            stretches=self._floor if frames.floor is None else frames.floor,
            focus=points[:, names["A"]],
            span=0.85 * tall,
            height=1.05 * tall,
            left=0.46,
            low=-self._surface,
            reach=CONE_LENGTH * tall,
            force=WEIGHT_LENGTH * tall,
            weight=self._weight if frames.weight is None else frames.weight,
            marks=marks,
            active=leg,
            follow_height=False,
            legend=LEGEND,
        )


def biped_drawing(
    frames: BipedFrame, params: BipedParams, scene: Scene, slips: np.ndarray
) -> Drawing:
    """The drawing of one robot's walk in one scene. slips: whether the foot slips by then [n]."""
    frames, marks = frames.rows(), SlipMarks(most=None)
    marks.record(frames)
    return BipedSketch(params, scene).drawing(frames, marks.rows(), slips)


class BipedRenderer(Renderer[BipedFrame]):
    """Draws frames of one robot in one scene; the camera keeps the hip in place.

    params, scene: one robot and one scene, not batches; a frame may bring its episode's own floor
    and weight.
    """

    def __init__(self, params: BipedParams, scene: Scene):
        super().__init__()
        self._sketch = BipedSketch(params, scene)
        self._marks = SlipMarks()

    def reset(self) -> None:
        """Forget the history: a floor without marks."""
        super().reset()
        self._marks = SlipMarks()

    def draw(self, frame: BipedFrame) -> np.ndarray:
        """The picture of a frame: uint8 [height, width, 3], a fresh array."""
        return super().draw(frame.rows())

    def drawing(self, frame: BipedFrame) -> Drawing:
        """The drawing of one sample, with the marks of slides since `reset`."""
        self._marks.record(frame)
        return self._sketch.drawing(frame, self._marks.rows())

    def readout(self, frame: BipedFrame) -> Readout:
        """Time, way, rate, torque, slide and friction."""
        walked, normal, mu = (
            float(of[0]) for of in (frame.walked, frame.normal_force, frame.mu_static)
        )
        if np.isnan(walked):
            (hip,) = self._sketch.mechanism.poses(frame.phase % (2 * pi)).pins["A"]
            walked = float(frame.floor_position[0] + hip[0, 0]) - self._sketch.mechanism.start
        use = written(abs(frame.friction_force[0]) / normal, 2) if normal > 0 else "–"
        wanted = float(frame.commanded_rate[0])
        asked = "" if np.isnan(wanted) else f" of {brief(wanted)}"
        ended = frame.status.lower() not in ("ok", "slip_onset")
        sticks = bool(frame.sticking[0])
        state = ("STICK", theme.HOLDS) if sticks else ("SLIP", theme.SLIDES)
        return Readout(
            numbers=(
                ("time  [s]", written(frame.time[0], 2)),
                ("walked  [m]", written(walked, 2)),
                ("steps", f"{frame.steps[0]}"),
                ("mean rate  [rad/s]", brief(frame.mean_crank_rate[0]) + asked),
                ("torque  [N m]", brief(frame.torque[0])),
                ("slide  [mm]", written(1000 * frame.slide[0], 1)),
                ("friction / normal", use if np.isnan(mu) else f"{use} of {mu:.2f}"),
            ),
            badge=frame.status.replace("_", " ").upper() if ended else state[0],
            colour=theme.INK if ended else state[1],
            at=float(frame.time[0]),
        )


def _points(poses: Pose, place: np.ndarray, leg: np.ndarray) -> tuple[np.ndarray, dict[str, int]]:
    """Pins in the world [n, p, 2], those of each leg apart, and the index of each by its name.

    Poses put the supporting leg first; here a leg keeps its place, so that what lies between two
    samples is between two places of the same pin.
    """
    rows, names, count = [], {}, np.arange(len(leg))
    shift = np.stack([place, np.zeros_like(place)], axis=-1)
    for side in (0, 1):
        which = np.where(leg == side, 0, 1)
        for name in (*OWN, "crank_pin"):
            names[f"{name}{side}"] = len(rows)
            rows.append(poses.pins[name][count, which] + shift)
    for name in "ABD":
        names[name] = len(rows)
        rows.append(poses.pins[name][:, 0] + shift)
    return np.stack(rows, axis=1), names


def _bodies(poses: Pose, points: np.ndarray, names: dict[str, int], leg: np.ndarray) -> np.ndarray:
    """Place and direction of both feet and of the hip [n, 3, 3]."""
    found = []
    for side in (0, 1):
        feet = poses.feet[np.arange(len(leg)), np.where(leg == side, 0, 1)]
        angle = np.arctan2(feet[:, 1], feet[:, 0])
        found.append(np.column_stack([points[:, names[f"E{side}"]], angle]))
    ahead = points[:, names["B"]] - points[:, names["A"]]
    angle = np.arctan2(ahead[:, 1], ahead[:, 0])
    found.append(np.column_stack([points[:, names["A"]], angle]))
    return np.stack(found, axis=1)


def _parts(mechanism: Mechanism, names: dict[str, int]) -> tuple[Part, ...]:
    """Hip, legs, crank and pins, back to front."""
    slot = mechanism.slot
    half = np.array([0.0, 0.12 * mechanism.crank])
    groove = np.array([slot[0] - half, slot[1] - half, slot[1] + half, slot[0] + half])
    parts = [
        Part("hip", outline=mechanism.hip_outline, body=2, edge="hip-edge"),
        Part("page", outline=groove, body=2, edge="hip-edge"),
    ]
    for side in (0, 1):
        parts.append(Part("main", outline=mechanism.sole, body=side, group=side))
        for a, b, role in BARS:
            pair = tuple(names.get(f"{pin}{side}", names.get(pin, -1)) for pin in (a, b))
            width = theme.BAR_WIDTH[role]
            parts.append(Part(role, bars=(pair,), width=width, group=side))  # pyright: ignore[reportArgumentType], two of them
        pins = tuple(names[f"{name}{side}"] for name in OWN)
        parts.append(Part("main", dots=pins, width=4.4, group=side))
    arms = names["crank_pin0"], names["crank_pin1"]
    parts += [
        Part("motor", bars=(arms,), width=6.5),
        Part("motor", dots=(names["A"],), width=13.0),
        Part("motor", dots=arms, width=5.0),
        Part("hip-edge", dots=(names["B"], names["D"]), width=7.0),
    ]
    return tuple(parts)


def _contact(
    frames: BipedFrame, own: np.ndarray, surface: float, slips: np.ndarray
) -> GroundContact:
    """Force of the ground on one foot; NaN while the other one carries, or without a load."""
    x = frames.floor_position + frames.zmp
    return GroundContact(
        place=np.column_stack([x, np.full(len(x), surface)]),
        slope=np.zeros(len(x)),
        friction=frames.friction_force,
        normal=np.where(own & (frames.normal_force > 0), frames.normal_force, np.nan),
        mu_static=frames.mu_static,
        mu_kinetic=frames.mu_kinetic,
        slips=slips,
    )
