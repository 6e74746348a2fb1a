"""Design of the UGV: its lengths and the angles of its legs, which stay as they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.instances.ugv.posture import track_named
from stickslip.optim.posture.evaluate import finite_cost
from stickslip.optim.posture.problem import PostureProblem

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.ugv import Track
    from stickslip.optim.posture.evaluate import Posture

VEHICLE = {"body_length": (0.6, 1.1), "leg_length": (0.25, 0.45)}
"""Design variables of the UGV [m]; then the fixed leg angles [rad]."""
LEGS = (np.pi / 3, 2 * np.pi / 3)
STATIONS = 48


@dataclass(frozen=True)
class VehicleDesign:
    """A vehicle with fixed legs over a family of tracks: the mean of its criterion's values.

    Margins: those of `Posture.margins` at every station of every track, the least of each kind.
    """

    def __call__(
        self, data: tuple[Posture, ...], x: Float[Array, "n"], draw: Array
    ) -> tuple[Array, Array]:
        """Value [1] and margins [kinds of all tracks]."""
        numbers = dict(zip(VEHICLE, x, strict=False))
        angles = jnp.broadcast_to(x[len(VEHICLE) :], (STATIONS, 2))
        values, margins = [], []
        for each in data:
            posture = replace(each, params=each.params.replace(**numbers))
            at = posture.stations(angles)
            values.append(finite_cost(posture.criterion, at))
            margins += [jnp.min(of, axis=0) for of in posture.margins(at).values()]
        return jnp.mean(jnp.stack(values))[None], jnp.concatenate(margins)


def vehicle_design(criterion: str, tracks: tuple[str, ...]) -> FunctionProblem:
    """Wheelbase, leg length and the legs' angles, for several tracks at once."""
    data = tuple(_posture(track_named(one), criterion) for one in tracks)
    low = [*(low for low, _ in VEHICLE.values()), LEGS[0], LEGS[0]]
    high = [*(high for _, high in VEHICLE.values()), LEGS[1], LEGS[1]]
    return FunctionProblem(VehicleDesign(), data, np.array(low), np.array(high), forward=True)


def _posture(track: Track, criterion: str) -> Posture:
    start, end = float(np.asarray(track.start)), float(np.asarray(track.end))
    x = np.linspace(start + 2.5, end, STATIONS)
    usual = PostureProblem.along(track).params
    return PostureProblem(usual, track, x, criterion, leg_rate=None).posture
