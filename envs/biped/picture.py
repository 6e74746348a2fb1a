"""The biped in pictures: a walk's numbers, from an environment's states too, and their drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import floor_position
from stickslip.dynamics.biped.contact import friction_on, patch_at
from stickslip.dynamics.scene import Floor, Grip, Patches
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import BipedEnvState, drawn_robot, drawn_scene
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Drawing, GroundContact, Picture, Stretch
from stickslip.envs.rendering.linkage import SOLE, Mechanism

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.dynamics.biped import BipedModel, BipedParams, BipedState
    from stickslip.envs.biped.params import BipedEnvParams

Numbers: TypeAlias = Any
"""A number, or an array [n] of NumPy."""
FAR = 1e4
"""End of the outermost patches in the picture [m]."""
WEIGHT_LENGTH, CONE_LENGTH = 0.26, 0.36
"""Length of the arrow of the weight, and of friction cones, in robot heights."""
LEAST_SLIDE = 1e-5
"""A slide shorter than this leaves no mark [m]."""
LEAST_SLID = 1e-7
"""A foot that moved less in a control step stuck all the while [m]."""
LEGEND = (
    ("main", "supporting leg"),
    ("pale-main", "swinging leg"),
    ("hip-edge", "hip with its slot"),
    ("motor", "crank and motor"),
    ("holds", "foot sticks: ground force, cone"),
    ("slides", "foot slips; dashed: kinetic cone"),
)
UNKNOWN = ("mu_static", "mu_kinetic")
"""Numbers of a frame that may be NaN."""


def stretches_of(floor: Floor) -> tuple[Stretch, ...]:
    """One floor (not a batch) from left to right."""
    if isinstance(floor, Grip):
        return (Stretch(-FAR, FAR, theme.floor_colour(None), "no slip"),)
    edges = np.asarray(floor.edges, float) if isinstance(floor, Patches) else np.empty(0)
    static, kinetic = (np.asarray(mu, float) for mu in (floor.mu_static, floor.mu_kinetic))
    if edges.ndim > 1 or static.ndim > (1 if isinstance(floor, Patches) else 0):
        accepted = "one floor, for instance jax.tree.map(lambda leaf: leaf[0], scene)"
        raise ValueError(f"scene holds a batch of floors; accepted: {accepted}")
    ends = [-FAR, *np.clip(edges, -FAR, FAR).tolist(), FAR]
    mus = np.broadcast_arrays(static, kinetic, np.empty(len(edges) + 1))[:2]
    found = []
    for (start, end), mu, other in zip(pairwise(ends), *map(np.ndarray.tolist, mus), strict=True):
        words = f"μ {mu:.3g}" if mu == other else f"μₛ {mu:.3g}   μₖ {other:.3g}"
        found.append(Stretch(start, end, theme.floor_colour(mu), words, mu < theme.SLIPPERY))
    return tuple(found)


@dataclass(frozen=True)
class BipedFrame:
    """PASIBOT's walk at n instants in a row, numbers [n]. Only positions follow from it.

    phase: crank angle of the supporting leg [rad]. floor: of the episode. weight: of the robot in
    it [N]. steps: exchanges of support so far. floor_position: of the supporting ankle [m]. slide:
    of the feet since the start, forwards positive; slid: either direction [m]. crank_rate [rad/s].
    time [s]. torque: of the motor on the crank [N m]. friction_force, normal_force: of the ground
    on the foot, forwards and upwards [N]. zmp: zero-moment point before the supporting ankle [m].
    mu_static, mu_kinetic: friction under the foot [-], NaN where it cannot slip. slips: whether the
    foot slips by then. walked: by the centre of mass since the start [m]. ended: cause of the
    walk's early end, or "".

    Numbers may be given for all instants alike. What is not finite becomes 0, so that a walk whose
    numbers overflow has a last picture, too.
    """

    phase: Numbers
    floor: tuple[Stretch, ...]
    weight: float
    steps: Numbers = 0
    floor_position: Numbers = 0.0
    slide: Numbers = 0.0
    slid: Numbers = 0.0
    crank_rate: Numbers = 0.0
    time: Numbers = 0.0
    torque: Numbers = 0.0
    friction_force: Numbers = 0.0
    normal_force: Numbers = 0.0
    zmp: Numbers = 0.0
    mu_static: Numbers = np.nan
    mu_kinetic: Numbers = np.nan
    slips: Numbers = False
    walked: Numbers = 0.0
    ended: str = ""

    def __post_init__(self):
        names = [one.name for one in fields(self) if one.name not in ("floor", "weight", "ended")]
        columns = np.broadcast_arrays(*(np.atleast_1d(getattr(self, name)) for name in names))
        for name, column in zip(names, columns, strict=True):
            finite = column if name in UNKNOWN else np.nan_to_num(column, posinf=0.0, neginf=0.0)
            object.__setattr__(self, name, finite)

    @property
    def friction_use(self) -> np.ndarray:
        """|F| / N [n]; NaN where N = 0."""
        normal = np.where(self.normal_force > 0, self.normal_force, np.nan)
        return np.abs(self.friction_force) / normal


def slipping(mode: Numbers, slid: Numbers) -> np.ndarray:
    """Whether the foot slips after steps in which it slid so far [n, m]."""
    return (np.asarray(mode) != 0) | (np.asarray(slid) > LEAST_SLID)


def biped_picture(frames: BipedFrame, robot: BipedParams) -> Picture:
    """A walk with the numbers above it; robot: one, not a batch."""
    return Picture(
        drawing=biped_drawing(frames, Mechanism(robot)),
        numbers=(
            ("time [s]", frames.time, 2),
            ("walked [m]", frames.walked, 2),
            ("crank rate [rad/s]", frames.crank_rate, 2),
            ("torque [N m]", frames.torque, 2),
            ("friction / normal", frames.friction_use, 2),
            ("distance slid [mm]", 1e3 * frames.slid, 1),
        ),
        slips=frames.slips,
        ended=frames.ended,
    )


def slip_marks(slide: np.ndarray, place: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """See Drawing.marks [m, 4]: a row for each instant at which the foot had slid since the one
    before. slide, place: of the supporting foot [m]; steps: exchanges of support; each [n]."""
    slid = np.diff(slide, prepend=slide[:1])
    at = np.flatnonzero(np.abs(slid) >= LEAST_SLIDE)
    if not len(at):
        return np.empty((0, 4))
    ends = np.stack([place, place - slid])[:, at]
    low, high = ends.min(axis=0), ends.max(axis=0)
    exchange = np.diff(steps[at]) != 0
    first = np.flatnonzero(np.append(True, exchange))
    length = np.full(len(at), np.nan)
    whole = np.maximum.reduceat(high, first) - np.minimum.reduceat(low, first)
    length[np.append(exchange, True)] = whole
    return np.stack([at, low, high, length], axis=-1)


def biped_drawing(frames: BipedFrame, mechanism: Mechanism) -> Drawing:
    """The drawing of a walk; the camera keeps the hip in place."""
    leg, surface = frames.steps % 2, -SOLE * mechanism.crank
    points, bodies = mechanism.placed(frames.phase % (2 * pi), frames.floor_position, leg)
    tall = mechanism.top - surface
    return Drawing(
        points=points,
        bodies=bodies,
        parts=mechanism.parts,
        contacts=tuple(_contact(frames, leg == k, surface) for k in (0, 1)),
        ground=np.array([[-FAR, surface], [FAR, surface]]),
        stretches=frames.floor,
        focus=bodies[:, 2, :2],
        span=0.85 * tall,
        height=1.05 * tall,
        left=0.46,
        low=-surface,
        reach=CONE_LENGTH * tall,
        force=WEIGHT_LENGTH * tall,
        weight=frames.weight,
        marks=slip_marks(frames.slide, frames.floor_position, frames.steps),
        active=leg,
        follow_height=False,
        legend=LEGEND,
    )


def _contact(frames: BipedFrame, own: np.ndarray, surface: float) -> GroundContact:
    """Force of the ground on one foot; NaN while the other one carries, or without a load."""
    x = frames.floor_position + frames.zmp
    return GroundContact(
        place=np.column_stack([x, np.full(len(x), surface)]),
        slope=np.zeros(len(x)),
        friction=frames.friction_force,
        normal=np.where(own & (frames.normal_force > 0), frames.normal_force, np.nan),
        mu_static=frames.mu_static,
        mu_kinetic=frames.mu_kinetic,
        slips=frames.slips,
    )


def biped_frames(
    states: BipedEnvState, infos: Mapping[str, np.ndarray], params: BipedEnvParams
) -> BipedFrame:
    """The frame of states in a row, every leaf [n], with the info of the step that led to each."""
    place, (mu_static, mu_kinetic), floor, weight = jax.device_get(_seen(states, params))
    states = jax.device_get(states)
    biped = states.biped
    status = Status(int(infos["status"][-1]) if "status" in infos else Status.OK)
    forces = ("torque", "friction_force", "normal_force", "zmp")
    return BipedFrame(
        phase=np.asarray(biped.phase, float),
        floor=stretches_of(floor),
        weight=float(weight),
        steps=biped.steps,
        floor_position=np.asarray(place, float),
        slide=np.asarray(biped.foot_position, float),
        slid=np.asarray(states.totals.slid, float),
        crank_rate=np.asarray(biped.crank_rate, float),
        time=np.asarray(biped.time, float),
        **{name: np.asarray(infos.get(name, 0.0), float) for name in forces},
        mu_static=np.asarray(mu_static, float),
        mu_kinetic=np.asarray(mu_kinetic, float),
        slips=slipping(states.mode, infos.get("slid", 0.0)),
        walked=np.asarray(states.totals.walked, float),
        ended=status.words if status.terminal else "",
    )


@jax.jit
def _seen(states: BipedEnvState, params: BipedEnvParams):
    """Place and friction of the supporting foot [n], and the episode's floor and weight [N]."""
    drawn = jax.tree.map(lambda leaf: leaf[0], states.drawn)  # by a reset
    robot, floor = drawn_robot(drawn, params), drawn_scene(drawn, params).floor
    seen = jax.vmap(lambda state: under_foot(robot, floor, state.biped))(states)
    return *seen, floor, robot.total_mass * robot.gravity


def under_foot(
    robot: BipedModel, floor: Floor, state: BipedState
) -> tuple[Array, tuple[Array, Array]]:
    """Place of the supporting foot [m]; friction under it, NaN where it cannot slip."""
    place, velocity = floor_position(robot, state), jnp.asarray(state.foot_velocity)
    if isinstance(floor, Grip):
        none = jnp.full_like(place, jnp.nan)
        return place, (none, none)
    return place, friction_on(floor, patch_at(floor, place, velocity), velocity.dtype)
