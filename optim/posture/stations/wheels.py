"""Distance between the wheels, a function of the leg angles alone."""

from __future__ import annotations

import numpy as np

from stickslip.dynamics.ugv import UGVParams

FINE = 181
"""Sampled angles of a leg."""
ALLOWED = 1.05
"""Times what `nearer_between` finds to second order, for the rest."""


def longest_wheelbase(params: UGVParams) -> float:
    """The greatest distance of the wheels' centres over all leg angles in the range [m]."""
    angles = np.linspace(float(params.leg_angle_min), float(params.leg_angle_max), FINE)
    return float(np.max(wheelbase(params, angles[:, None], angles)))


def wheelbase(params: UGVParams, rear: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Distance of the wheels' centres at these angles [rad], broadcast [m]."""
    l, L = float(params.leg_length), float(params.body_length)
    along = L - l * (np.cos(rear) + np.cos(front))
    return np.hypot(along, l * (np.sin(rear) - np.sin(front)))


def nearer_between(params: UGVParams, turn: float) -> float:
    """Greatest approach of the wheels between two waypoints, below their distance at both [m].

    turn: the most that a leg turns from one to the next, evenly [rad]. Where the wheels are closest
    their distance does not change along the move. So of the postures with wheels that just touch,
    one for each angle of the rear leg, the moves along which the distance is stationary are looked
    at: the most that it grows towards both ends.
    """
    l, L = float(params.leg_length), float(params.body_length)
    low, high = float(params.leg_angle_min), float(params.leg_angle_max)
    least = 2 * float(params.wheel_radius) + float(params.wheel_gap)
    rear = np.linspace(low, high, FINE)
    across, up = l * np.cos(rear) - L, -l * np.sin(rear)
    cosine = (least**2 - L**2 - 2 * l**2 + 2 * L * l * np.cos(rear)) / (
        2 * l * np.hypot(across, up)
    )
    swing = np.arccos(np.where(np.abs(cosine) <= 1, cosine, np.nan))
    front = (np.arctan2(up, across) + np.stack([swing, -swing])) % (2 * np.pi)
    pairs = np.stack(np.broadcast_arrays(rear, front)).reshape(2, -1)
    pairs = pairs[:, (pairs[1] >= low) & (pairs[1] <= high)]
    way = (L * np.sin(pairs) - l * np.sin(np.sum(pairs, axis=0)))[::-1] * [[1.0], [-1.0]]
    way *= turn / 2 / np.max(np.abs(way), axis=0)
    grown = np.zeros(pairs.shape[1])
    for move in (way, -way):
        room = np.where(move > 0, high - pairs, pairs - low)
        share = np.min(room / np.maximum(np.abs(move), room + 1e-300), axis=0)
        grown += (wheelbase(params, *(pairs + share * move)) - least) / 2
    return ALLOWED * float(np.max(grown, initial=0.0))
