"""M, P, Y of MODEL 1.4 and the ground's moment: exact, or fitted on the support phase.

All are functions of the crank angle alone. Fitted ones are piecewise polynomials or one Chebyshev
series each: the slopes are interpolated at Chebyshev nodes (in every piece) and integrated, so that
dM is exactly the derivative of M inside a piece, and single precision keeps its digits in both.
Beyond the ends of the support phase the outermost pieces go on for one more length, which is what
locating the exchange needs; farther out the values stay what they are there. One series of high
degree needs no piece to be looked up, but all its terms (`python -m benchmarks.tradeoff`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import links
from stickslip.dynamics.pytrees import Number, float_type, pytree_dataclass, run_once

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.biped.settings import Chebyshev, Table
    from stickslip.dynamics.pytrees import Integer, Scalar


class ReducedInertia(NamedTuple):
    """M, P, Y of MODEL 1.4 and their derivatives by the crank angle; all depend on it alone."""

    M: Scalar
    """sum m (X'^2 + y'^2) + I phi'^2 [kg m^2]"""
    dM: Scalar
    P: Scalar
    """sum m X' [kg m]"""
    dP: Scalar
    Y: Scalar
    """sum m y' [kg m]; gravity times Y is the slope of the potential energy"""
    dY: Scalar

    @property
    def P_crank(self) -> Scalar:
        """Coefficient of a1 in the crank's equation: P, since derivatives are exact."""
        return self.P

    @property
    def Y_crank(self) -> Scalar:
        """Coefficient of gravity in the crank's equation: Y."""
        return self.Y


class DifferencedInertia(NamedTuple):
    """Coefficients when the links' motion is differenced: the crank's equation has its own.

    T = M alpha + P_crank a1 + dM w^2 / 2 + g Y_crank, f = P alpha + m a1 + dP w^2,
    N = m g + Y alpha + dY w^2. Exactly differentiated, P_crank = P and Y_crank = Y. Here the first
    two are the virtual power of the exact geometry, P and Y the differenced momenta.
    """

    M: Scalar
    dM: Scalar
    """Twice the coefficient of w^2 in the crank's equation."""
    P: Scalar
    dP: Scalar
    Y: Scalar
    dY: Scalar
    P_crank: Scalar
    Y_crank: Scalar


class GroundMoment(NamedTuple):
    """Terms of the ground's moment about the ankle (eq. 30)."""

    L: Scalar
    """Angular momentum about the ankle per crank rate: sum m (X y' - y X') + I phi' [kg m^2]"""
    dL: Scalar
    X: Scalar
    """sum m X [kg m]"""
    Y: Scalar
    """sum m y [kg m]"""


def reduced_inertia(params: BipedParams, theta: Real[Number, ""]) -> ReducedInertia:
    """M, dM, P, dP, Y, dY at crank angle `theta` [rad] of the supporting leg (MODEL 1.4).

    Exact: forward-mode differentiation of the kinematics, where the chapter's eqs. (23)-(25) take
    forward differences. Scalars: batch with vmap.
    """
    return inertia_and_moment(params, theta)[0]


def ground_moment(params: BipedParams, theta: Real[Number, ""]) -> GroundMoment:
    """L, dL and the first mass moments about the supporting ankle, at crank angle `theta` [rad]."""
    return inertia_and_moment(params, theta)[1]


@run_once
def inertia_and_moment(
    params: BipedParams, theta: Real[Number, ""]
) -> tuple[ReducedInertia, GroundMoment]:
    """`reduced_inertia` and `ground_moment` in one program half as large as the two."""
    if jnp.issubdtype(jnp.result_type(theta), jnp.integer):
        theta = jnp.asarray(theta, float_type(params))
    (M, P, Y, L), (dM, dP, dY, dL), centres = jax.jvp(
        lambda angle: _momenta(params, angle), (theta,), (jnp.ones_like(theta),), has_aux=True
    )
    X, height = jnp.sum(body_masses(params)[:, None] * centres, axis=0)
    return ReducedInertia(M, dM, P, dP, Y, dY), GroundMoment(L, dL, X, height)


def body_masses(params: BipedParams) -> Float[Array, " 24"]:
    """Masses of the 24 bodies in the order of BODIES [kg], the payload on the hip."""
    mass = jnp.asarray(params.mass)
    at_hip = np.arange(mass.shape[-1]) == 12
    return jnp.where(at_hip, mass + params.payload, mass)[links.LINK_OF_BODY]


def _momenta(params: BipedParams, theta: Scalar) -> tuple[tuple[Scalar, ...], Float[Array, "24 2"]]:
    """Generalised momenta per unit crank rate, M, P, Y, L, and the centres of mass [m]."""

    (centres, _), (velocity, turning) = jax.jvp(
        lambda angle: links.centres_and_angles(params, angle), (theta,), (jnp.ones_like(theta),)
    )
    mass, inertia = body_masses(params), jnp.asarray(params.inertia)[links.LINK_OF_BODY]
    M = jnp.sum(mass * jnp.sum(velocity**2, axis=-1)) + jnp.sum(inertia * turning**2)
    P, Y = jnp.sum(mass[:, None] * velocity, axis=0)
    spin = centres[:, 0] * velocity[:, 1] - centres[:, 1] * velocity[:, 0]
    L = jnp.sum(mass * spin) + jnp.sum(inertia * turning)
    return (M, P, Y, L), centres


class Inertia(ABC):
    """The inertia functions of a robot, or of some of its masses; scalars: batch with vmap."""

    @abstractmethod
    def at(self, theta: Scalar) -> ReducedInertia | DifferencedInertia:
        """M, P, Y and slopes at `theta` [rad]."""

    @abstractmethod
    def moment_at(self, theta: Scalar) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad]."""

    def spin_at(self, theta: Scalar) -> tuple[Scalar, Scalar]:
        """L and its slope alone, at `theta` [rad]."""
        return self.moment_at(theta)[:2]

    def member(self, place: Integer) -> Inertia:
        """Those of one robot of a batch [n]."""
        return jax.tree.map(lambda leaf: leaf[place], self)


@pytree_dataclass
class ExactInertia(Inertia):
    """The reference: exact functions of the crank angle, from the linkage at every call."""

    params: BipedParams

    def at(self, theta: Scalar) -> ReducedInertia:
        return reduced_inertia(self.params, theta)

    def moment_at(self, theta: Scalar) -> GroundMoment:
        return ground_moment(self.params, theta)


@pytree_dataclass
class TableInertia(Inertia):
    """Coefficients by rising power of the position in [-1, 1] within a piece."""

    momenta: Float[Array, "pieces 3 powers"]
    """M, P, Y"""
    moments: Float[Array, "pieces 3 powers"]
    """L and the mass moments sum m X, sum m y"""
    place: Integer | None = None
    """Of the robot, where the coefficients are those of a batch; only its pieces are read."""

    def at(self, theta: Scalar) -> ReducedInertia:
        (M, P, Y), (dM, dP, dY) = _evaluate(self.momenta, theta, self.place)
        return ReducedInertia(M, dM, P, dP, Y, dY)

    def moment_at(self, theta: Scalar) -> GroundMoment:
        (L, X, Y), (dL, _, _) = _evaluate(self.moments, theta, self.place)
        return GroundMoment(L, dL, X, Y)

    def spin_at(self, theta: Scalar) -> tuple[Scalar, Scalar]:
        (L,), (dL,) = _evaluate(self.moments[..., :1, :], theta, self.place)
        return L, dL

    def member(self, place: Integer) -> TableInertia:
        return replace(self, place=place)


def fit_table(params: BipedParams, table: Table) -> TableInertia:
    """Build the table from the exact functions; pure, so that vmapped parameters fit their own."""
    width = (links.SUPPORT_END - links.SUPPORT_START) / table.pieces
    dtype = float_type(params)
    # Chebyshev nodes for the slope, and the matrix from its values there to its powers.
    nodes = np.cos((np.arange(table.degree) + 0.5) * np.pi / table.degree)
    to_powers = np.linalg.inv(np.vander(nodes, increasing=True))
    middles = links.SUPPORT_START + width * (np.arange(table.pieces) + 0.5)
    inertia, moment = jax.vmap(jax.vmap(lambda angle: inertia_and_moment(params, angle)))(
        jnp.asarray(middles[:, None] + width / 2 * np.append(nodes, 0.0), dtype)
    )

    counts = jnp.arange(1, table.degree + 1, dtype=dtype)

    def powers(
        value: Float[Array, "pieces nodes"], slope: Float[Array, "pieces nodes"]
    ) -> Float[Array, "pieces powers"]:
        """Integrate the interpolated slope; the constant is the value at the piece's middle."""
        rising = slope[:, :-1] @ jnp.asarray(to_powers.T, dtype) * dtype.type(width / 2)
        return jnp.concatenate([value[:, -1:], rising / counts[None]], -1)

    momenta = [(inertia.M, inertia.dM), (inertia.P, inertia.dP), (inertia.Y, inertia.dY)]
    moments = [(moment.L, moment.dL), (moment.X, inertia.P), (moment.Y, inertia.Y)]
    both = (jnp.stack([powers(*pair) for pair in of], axis=1) for of in (momenta, moments))
    return TableInertia(*(of.astype(dtype) for of in both))


def _evaluate(
    coefficients: Float[Array, "*robots pieces n powers"], theta: Scalar, robot: Integer | None
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Values and slopes of the n polynomials of one table at `theta` (Horner's rule)."""
    pieces, _, powers = coefficients.shape[-3:]
    scale = pieces / (links.SUPPORT_END - links.SUPPORT_START)
    place = (theta - links.SUPPORT_START) * scale
    piece = jnp.clip(jnp.floor(place), 0, pieces - 1)
    piece_of = piece.astype(jnp.int32)
    row = coefficients[piece_of] if robot is None else coefficients[robot, piece_of]
    u = jnp.clip(2 * (place - piece) - 1, -3.0, 3.0)
    value, slope = row[:, powers - 1], jnp.zeros_like(row[:, 0])
    for k in range(powers - 2, -1, -1):
        slope = slope * u + value
        value = value * u + row[:, k]
    return value, slope * (2 * scale)


@pytree_dataclass
class SeriesInertia(Inertia):
    """Chebyshev coefficients of values and slopes, by rising degree; slopes by the crank angle."""

    momenta: Float[Array, "degrees 6"]
    """M, P, Y and their slopes"""
    moments: Float[Array, "degrees 4"]
    """L, its slope, and the mass moments sum m X, sum m y"""

    def at(self, theta: Scalar) -> ReducedInertia:
        """M, P, Y and slopes at `theta` [rad]; along a straight line beyond the series' reach."""
        (*values, dM, dP, dY), beyond = _clenshaw(self.momenta, theta)
        slopes = (dM, dP, dY)
        M, P, Y = (value + slope * beyond for value, slope in zip(values, slopes, strict=True))
        return ReducedInertia(M, dM, P, dP, Y, dY)

    def moment_at(self, theta: Scalar) -> GroundMoment:
        return GroundMoment(*_clenshaw(self.moments, theta)[0])

    def spin_at(self, theta: Scalar) -> tuple[Scalar, Scalar]:
        L, dL = _clenshaw(self.moments[:, :2], theta)[0]
        return L, dL


def fit_series(params: BipedParams, spec: Chebyshev) -> SeriesInertia:
    """Interpolate the slopes at Chebyshev nodes, integrate; pure: vmapped robots fit their own."""
    dtype = float_type(params)
    count, half = spec.degree + 1, (links.SUPPORT_END - links.SUPPORT_START) / 2
    places = (np.arange(count) + 0.5) * np.pi / count
    # From values to Chebyshev coefficients; from these to the integral's, but for its constant.
    transform = 2 / count * np.cos(np.outer(np.arange(count), places))
    transform[0] /= 2
    integrate = np.polynomial.chebyshev.chebint(np.eye(count))[:count]
    angles = jnp.asarray(links.SUPPORT_START + half * (1 + np.cos(places)), dtype)
    inertia, moment = jax.vmap(lambda angle: inertia_and_moment(params, angle))(angles)
    to_slope = jnp.asarray(transform, dtype)
    values = (inertia.M, inertia.P, inertia.Y, moment.L, moment.X, moment.Y)
    slopes = (inertia.dM, inertia.dP, inertia.dY, moment.dL, inertia.P, inertia.Y)
    slope = to_slope @ jnp.stack(slopes, axis=1)
    # Integrated slopes, with the constant that fits the values' mean.
    value = jnp.asarray(half * integrate, dtype) @ slope
    value = value.at[0].set((to_slope @ jnp.stack(values, axis=1))[0])
    momenta = jnp.concatenate([value[:, :3], slope[:, :3]], axis=1)
    moments = jnp.stack([value[:, 3], slope[:, 3], value[:, 4], value[:, 5]], axis=1)
    return SeriesInertia(momenta.astype(dtype), moments.astype(dtype))


def _clenshaw(
    coefficients: Float[Array, "degrees k"], theta: Scalar
) -> tuple[Float[Array, " k"], Scalar]:
    """Sums of the series at `theta` (Clenshaw's recurrence), and how far beyond its reach that is
    [rad]: there they are those of its reach's end.

    A trial step may end far behind the support phase, where terms of high degree grow without
    bound. Within 4.5 / degree^2 of the interval's half none exceeds cosh(3) = 10.
    """
    half = (links.SUPPORT_END - links.SUPPORT_START) / 2
    reach = 1 + 4.5 / (len(coefficients) - 1) ** 2
    place = (theta - links.SUPPORT_START) / half - 1
    u = jnp.clip(place, -reach, reach)

    def term(carry: tuple[Float[Array, " k"], Float[Array, " k"]], row: Float[Array, " k"]):
        later, latest = carry
        return (row + 2 * u * later - latest, later), None

    zero = jnp.zeros(coefficients.shape[1:], jnp.result_type(coefficients, u))
    (first, second), _ = jax.lax.scan(term, (zero, zero), coefficients[:0:-1])
    return coefficients[0] + u * first - second, half * (place - u)
