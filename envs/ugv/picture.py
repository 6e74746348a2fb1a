"""The UGV in pictures: a drive's numbers, from UGVEnv's states too, and their drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, place
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Drawing, GroundContact, Part, Picture, Stretch
from stickslip.envs.ugv.state import UGVEnvState, ground, places_ahead
from stickslip.optim.gait.gait import friction_uses

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.dynamics.pytrees import Number
    from stickslip.dynamics.ugv import Odometer, Pose, UGVParams
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.optim.posture.criteria import Station

    Array: TypeAlias = jax.Array | np.ndarray
    Sampled: TypeAlias = tuple[Pose, Array, Array, Array, Array | None]

WEIGHT_LENGTH, CONE_LENGTH = 1.5, 0.62
"""Lengths of the arrow of a force that equals the weight, and of friction cones [m]."""
SPOKES = 5
THICK = 0.06
"""Half the drawn thickness of the body, in its length."""
LEGEND = (
    ("hip-edge", "body"),
    ("mid", "legs"),
    ("motor", "motors"),
    ("holds", "wheel grips: cone of friction, force of the ground"),
    ("slides", "wheel slips"),
)
MOST_POINTS = 4000
"""Points of the ground's profile."""


@dataclass(frozen=True)
class UGVFrame:
    """The UGV at n stations, every leaf [n] and of NumPy. Nothing is computed but positions.

    at: forces and leg angles; placed: the pose, in the world. turned: each wheel's angle in the
    world, anticlockwise [n, 2] rad. ground: points [n, k, 2] of the profile about the vehicle, and
    preview: points [n, m, 2] of it that are observed, without noise [m]. cost: the criterion so
    far. status: codes of Status. start: where the drive began [m]. ground_mu: at the points of
    `ground` [n, k], None where it is the same everywhere.
    """

    at: Station
    placed: Pose
    turned: np.ndarray
    ground: np.ndarray
    preview: np.ndarray
    cost: np.ndarray
    status: np.ndarray
    start: float
    ground_mu: np.ndarray | None = None

    def wheels(self, name: str) -> np.ndarray:
        """An entry of the contacts of the rear and the front wheel [n, 2, ...]."""
        return np.stack([getattr(side, name) for side in (self.placed.rear, self.placed.front)], 1)

    @property
    def hinges(self) -> np.ndarray:
        """Hinges of both legs [n, 2, 2] m."""
        return np.stack([self.placed.rear_hinge, self.placed.front_hinge], axis=1)

    @property
    def forces(self) -> np.ndarray:
        """Friction along the ground, normal force [N] and mu of both wheels [n, 2, 3]."""
        return np.stack([np.stack(of, axis=-1) for of in self.at.wheels], axis=1)

    @property
    def mu(self) -> np.ndarray:
        """Under the wheels, the lesser of them [n]."""
        return self.forces[..., 2].min(axis=1)

    @property
    def demand(self) -> np.ndarray:
        """The greater |F| / N of both wheels [n]; infinite without a load."""
        friction, normal, _ = np.moveaxis(self.forces, -1, 0)
        return np.max(friction_uses(friction, normal), axis=1)

    @property
    def slips(self) -> np.ndarray:
        """True where a wheel's friction is used up [n]."""
        return (self.at.grip < 0) | (self.status == Status.WHEEL_SLIP)

    @property
    def slipping(self) -> np.ndarray:
        """True for the wheel with the lesser margin, once the friction is used up [n, 2]."""
        friction, normal, mu = np.moveaxis(self.forces, -1, 0)
        margin = mu * normal - np.abs(friction)
        return self.slips[:, None] & (margin <= margin.min(axis=1, keepdims=True))


def ugv_drawing(frame: UGVFrame, vehicle: UGVParams) -> Drawing:
    """The drawing of one vehicle's drive."""
    length, radius = float(vehicle.body_length), float(vehicle.wheel_radius)
    reach = length + 2 * float(vehicle.leg_length)
    hinge, centre, place = frame.hinges, frame.wheels("centre"), frame.wheels("point")
    body = np.column_stack([hinge[:, 0], frame.placed.pitch])
    turned = np.concatenate([centre, frame.turned[..., None]], axis=-1)
    tangent = frame.wheels("tangent")
    friction, normal, mu = np.moveaxis(frame.forces, -1, 0)
    both = GroundContact(
        place=place,
        slope=np.arctan2(tangent[..., 1], tangent[..., 0]),
        friction=friction,
        normal=np.where(normal > 0, normal, np.nan),
        mu_static=mu,
        mu_kinetic=mu,
        slips=frame.slipping,
    )
    contacts = (GroundContact(*(of[:, i] for of in vars(both).values())) for i in (0, 1))
    ground, stretches = _ground(frame)
    seen = frame.preview if frame.preview.shape[1] else None
    words = {} if seen is None else {"motor": "motors; ground seen ahead"}
    return Drawing(
        points=np.stack([hinge[:, 0], centre[:, 0], hinge[:, 1], centre[:, 1]], axis=1),
        bodies=np.concatenate([body[:, None], turned], axis=1),
        parts=_parts(length, radius),
        contacts=tuple(contacts),
        ground=ground,
        stretches=stretches,
        focus=place.mean(axis=1),
        span=2.4 * reach,
        height=1.1 * reach,
        left=0.45,
        low=0.22 * reach,
        reach=CONE_LENGTH,
        force=WEIGHT_LENGTH,
        weight=float(vehicle.weight),
        seen=seen,
        legend=tuple((role, words.get(role, about)) for role, about in LEGEND),
    )


def ugv_picture(frame: UGVFrame, vehicle: UGVParams, criterion: str, unit: str) -> Picture:
    """A drive with the numbers above it; vehicle: not a batch. criterion, unit: of the cost."""
    status = Status(int(frame.status[-1]))
    return Picture(
        drawing=ugv_drawing(frame, vehicle),
        numbers=(
            ("driven [m]", np.asarray(frame.at.x - frame.start), 2),
            ("pitch [°]", np.degrees(frame.placed.pitch), 1),
            ("torque [N m]", np.asarray(frame.at.torque), 1),
            ("friction / normal", frame.demand, 2),
            (criterion.replace("_", " ") + ("" if unit == "-" else f" [{unit}]"), frame.cost, 2),
        ),
        slips=frame.slips,
        states=("GRIP", "SLIP"),
        ended="" if status == Status.OK else status.words,
    )


def _parts(length: float, radius: float) -> tuple[Part, ...]:
    """Wheels, body and legs, back to front."""
    turn = np.linspace(0, 2 * np.pi, 49)
    rim = radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    parts = []
    for body in (1, 2):
        parts.append(Part("tyre", outline=rim, body=body))
        parts.append(Part("rim", outline=0.74 * rim, body=body, edge="tyre"))
        for angle in 2 * np.pi / SPOKES * np.arange(SPOKES):
            along = np.array([np.cos(angle), np.sin(angle)])
            across = 0.03 * radius * np.array([-along[1], along[0]])
            end = 0.74 * radius * along
            spoke = np.array([across, end + across, end - across, -across])
            parts.append(Part("mid", outline=spoke, body=body, edge="mid"))
    hinges = np.array([[0.0, 0.0], [length, 0.0]])
    h = THICK * length  # the body is flattened at the front's upper corner
    corners = ((-h, -h), (h, -h), (1.4 * h, 0.2 * h), (-0.2 * h, 1.8 * h), (-h, 1.8 * h))
    outline = np.array(corners) + hinges[[0, 1, 1, 1, 0]]
    parts.append(Part("hip", outline=outline, body=0, edge="hip-edge"))
    width = theme.BAR_WIDTH["main"] + 2.0
    parts += [Part("mid", bars=(pair,), width=width) for pair in ((0, 1), (2, 3))]
    parts.append(Part("hip-edge", dots=(0, 2), width=8.0))
    parts.append(Part("motor", dots=(1, 3), width=8.0))
    return tuple(parts)


def _ground(frame: UGVFrame) -> tuple[np.ndarray, tuple[Stretch, ...]]:
    """The profile over the whole drive [k, 2] m, and its stretches of one friction."""
    points = frame.ground.reshape(-1, 2)
    order = np.argsort(points[:, 0], kind="stable")
    kept = order[np.unique(np.linspace(0, len(order) - 1, MOST_POINTS).astype(int))]
    points = points[kept]
    mu = np.full(len(points), frame.mu[0])
    if frame.ground_mu is not None:
        mu = np.round(frame.ground_mu.reshape(-1)[kept], 3)
    starts = [0, *(np.flatnonzero(np.diff(mu)) + 1).tolist()]
    edges = [*points[starts, 0].tolist(), float(points[-1, 0])]
    stretches = (
        Stretch(start, end, theme.floor_colour(mu[at]), f"μ {mu[at]:.3g}")
        for (start, end), at in zip(pairwise(edges), starts, strict=True)
    )
    return points, tuple(stretches)


GROUND_POINTS = 361
REACH = 4.0
"""Range of ground drawn before and behind the front contact, in vehicle lengths."""


def ugv_frames(
    states: UGVEnvState,
    infos: Mapping[str, np.ndarray],
    params: UGVEnvParams,
    solver: PoseSolver,
    seen: int,
) -> UGVFrame:
    """The frame of an episode's states, every leaf [n], with the info of the step that led to each.

    seen: how many points ahead are observed.
    """
    odometer, friction = ground(jax.tree.map(lambda leaf: leaf[0], states.drawn), params)
    at = states.station
    ahead = places_ahead(seen, params, jnp.result_type(at.x)) if seen else np.empty(0)
    status = infos.get("status", at.status)
    about = odometer, friction, params.vehicle, solver
    return station_frames(at, states.cost, *about, ahead, float(params.start), status)


def station_frames(
    stations: Station,
    costs: Array,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
    solver: PoseSolver,
    ahead: Float[Array, " m"] = np.empty(0),  # noqa: B008
    start: float | None = None,
    status: Array | None = None,
) -> UGVFrame:
    """The frame of a drive's stations [n]; costs: so far [n]; friction: mu, one or [n], by which a
    surface's is multiplied. ahead: distances of the points that are observed [m]. start: of the
    drive [m], by default the first station's; status: by default the stations' [n]."""
    placed = _placed(solver, stations, odometer, friction, vehicle, ahead)
    tree: Any = jax.device_get((*placed, stations, costs))
    pose, turned, points, seen, mu, at, cost = jax.tree.map(lambda leaf: leaf.astype(float), tree)
    return UGVFrame(
        at=at,
        placed=pose,
        turned=turned,
        ground=points,
        preview=seen,
        cost=cost,
        status=np.asarray(stations.status if status is None else status, int),
        start=float(stations.x[0]) if start is None else start,
        ground_mu=mu,
    )


@partial(jax.jit, static_argnums=0)
def _placed(solver: PoseSolver, stations: Station, *given: Any) -> Sampled:
    """Pose, angles of the wheels in the world, points of the ground, those observed, and mu at the
    points where the ground has a surface, each [n]. given: as of `station_frames`."""
    odometer, friction, vehicle, ahead = given
    track, kind = odometer.track, stations.x.dtype
    reach = REACH * (vehicle.body_length + 2 * vehicle.leg_length)
    about = reach * jnp.linspace(-1, 1, GROUND_POINTS, dtype=kind)

    def one(at: Station, friction: Number) -> Sampled:
        placed = place(vehicle, track, at.x, at.leg_angles, solver)
        wheels, r = (placed.rear, placed.front), vehicle.wheel_radius
        turned = [wheel.slope_angle - odometer.distance(wheel.x) / r for wheel in wheels]
        places = at.x + about, at.x + ahead.astype(kind)
        points, seen = (jnp.stack([x, track.height(x)], -1) for x in places)
        surface = track.surface
        mu = None if surface is None else surface.mu(friction, surface.at(at.x + about))
        return placed, jnp.stack(turned), points, seen, mu

    return jax.vmap(one)(stations, jnp.broadcast_to(friction, stations.x.shape))
