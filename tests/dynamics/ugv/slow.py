"""The half vehicle worked out again, slowly and by other means, in NumPy and SciPy alone.

The rear contact by bisection, the forces from the three equations of the whole vehicle, the way by
quadrature; one posture at a time, places and heights counted from a knot near by.
"""

from itertools import pairwise, product

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from stickslip.dynamics.ugv import UGVParams


class Slow:
    """A vehicle on the natural cubic spline through points; x are counted from `origin`[0]."""

    def __init__(self, x, y, origin=(0.0, 0.0), params: UGVParams | None = None):
        self.p = UGVParams() if params is None else params
        self.knots = np.asarray(x) - origin[0]
        self.ground = CubicSpline(self.knots, np.asarray(y) - origin[1], bc_type="natural")
        self.slope, self.bend = self.ground.derivative(1), self.ground.derivative(2)

    def centre(self, x):
        m = self.slope(x)
        normal = np.array([-m, 1.0]) / np.sqrt(1 + m * m)
        return np.array([x, self.ground(x)]) + self.p.wheel_radius * normal

    def rear(self, x_front, chord):
        """The nearest place behind at which the centres are a chord apart."""
        front = self.centre(x_front)

        def missed(x):
            return np.hypot(*(self.centre(x) - front)) - chord

        places = x_front - np.linspace(0.0, 1.5 * chord + 0.5, 400)
        values = [missed(x) for x in places]
        i = next(i for i in range(1, 400) if values[i] > 0)
        return brentq(missed, places[i], places[i - 1], xtol=1e-15, rtol=1e-15)

    def held(self, x_front, angles):
        """Torque, normal forces, grip of each wheel at mu = 0, turns of both wheels, energy."""
        p, g = self.p, self.p.gravity
        r, l, L = p.wheel_radius, p.leg_length, p.body_length
        a, b = angles
        wheels = np.array([[l * np.cos(a), -l * np.sin(a)], [L - l * np.cos(b), -l * np.sin(b)]])
        chord = np.hypot(*(wheels[1] - wheels[0]))
        x = np.array([self.rear(x_front, chord), x_front])
        centres = np.array([self.centre(at) for at in x])
        world, own = centres[1] - centres[0], wheels[1] - wheels[0]
        pitch = np.arctan2(world[1], world[0]) - np.arctan2(own[1], own[0])
        turn = np.array([[np.cos(pitch), -np.sin(pitch)], [np.sin(pitch), np.cos(pitch)]])
        hinges = centres[0] + (np.array([[0.0, 0.0], [L, 0.0]]) - wheels[0]) @ turn.T
        masses = [(p.wheel_mass, centres[0]), (p.wheel_mass, centres[1]),
                  (p.leg_mass, (hinges[0] + centres[0]) / 2),
                  (p.leg_mass, (hinges[1] + centres[1]) / 2),
                  (p.body_mass, hinges.mean(0))]  # fmt: skip
        slope = np.array([float(self.slope(at)) for at in x])
        along = np.stack([np.ones(2), slope], -1) / np.sqrt(1 + slope**2)[:, None]
        out = np.stack([-along[:, 1], along[:, 0]], -1)
        arms = np.stack([x, [float(self.ground(at)) for at in x]], -1) - centres[1]

        def moment(arm, force):
            return arm[0] * force[1] - arm[1] * force[0]

        rows = np.zeros((3, 3))
        rows[:2] = np.stack([along[0] + along[1], out[0], out[1]], -1)
        rows[2] = [
            moment(arms[0], along[0]) + moment(arms[1], along[1]),
            moment(arms[0], out[0]), moment(arms[1], out[1]),
        ]  # fmt: skip
        weight = sum(m for m, _ in masses) * g
        about = sum(m * g * (at[0] - centres[1, 0]) for m, at in masses)
        F, N_rear, N_front = np.linalg.solve(rows, [0.0, weight, about])
        turned = [np.arctan(slope[i]) - self.way(x[i]) / r - pitch for i in (0, 1)]
        turned = turned[0] + a + turned[1] - b
        energy = g * sum(m * at[1] for m, at in masses)
        return {"torque": -F * r, "F": F, "N": (N_rear, N_front), "turn": turned,
                "energy": energy, "rear": x[0]}  # fmt: skip

    def way(self, x):
        """Arc length from x = 0, Gauss-Legendre with 12 points between neighbouring knots."""
        low, high = min(x, 0.0), max(x, 0.0)
        edges = [low, *self.knots[(self.knots > low) & (self.knots < high)], high]
        nodes, weights = np.polynomial.legendre.leggauss(12)
        total = 0.0
        for a, b in pairwise(edges):
            at = (a + b) / 2 + (b - a) / 2 * nodes
            total += (b - a) / 2 * float(weights @ np.sqrt(1 + self.slope(at) ** 2))
        return total if x > 0 else -total

    def wheel_energy(self, stations):
        """Work of the motors over a drive, none recovered; trapezoid rule over each step."""
        pairs = pairwise(stations)
        work = [(a["torque"] + b["torque"]) / 2 * (b["turn"] - a["turn"]) for a, b in pairs]
        return float(sum(max(w, 0.0) for w in work))

    def best(self, places, angles, most=np.inf):
        """The least wheel energy of all drives over a grid of angles, each one looked at."""
        pairs = list(product(angles, angles))
        stations = [[self.held(x, pair) for pair in pairs] for x in places]
        least = np.inf
        for chosen in product(range(len(pairs)), repeat=len(places)):
            steps = pairwise(chosen)
            if any(np.max(np.abs(np.subtract(pairs[i], pairs[j]))) > most for i, j in steps):
                continue
            drive = [stations[k][i] for k, i in enumerate(chosen)]
            least = min(least, self.wheel_energy(drive))
        return least
