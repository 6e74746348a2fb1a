"""The pin table: what is joined stays joined all the way round, and is named as it should be."""

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BODIES, kinematics
from stickslip.dynamics.biped.joints.pins import (
    GROUPS,
    JOINT_FORCES,
    JOINTS,
    LEG_LINKS,
    joint_geometry,
)
from tests.dynamics.biped.helpers import default_params

ANGLES = np.linspace(0, 2 * np.pi, 181)


@jax.jit
def geometry_along(params, angles):
    def one(angle):
        now = kinematics(params, angle)
        return now.centres, now.angles, *joint_geometry(now.pins, now.hip_pins)

    return jax.vmap(one)(angles)


def in_body(points, centres, angles):
    """Points seen from a body that turns."""
    away = np.asarray(points) - np.asarray(centres)
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]], -1)


def test_every_pin_is_a_fixed_point_of_both_its_bodies(float64):
    centres, angles, points, _ = map(
        np.asarray, geometry_along(default_params(), jnp.asarray(ANGLES))
    )
    for column, joint in enumerate(JOINTS):
        bodies = (joint.on,) if joint.axis == "normal" else (joint.on, joint.by)
        for body in bodies:
            place = in_body(points[:, column], centres[:, body], angles[:, body])
            assert np.max(np.abs(place - place[0])) < 1e-12, (JOINT_FORCES[column], BODIES[body])


def test_the_slot_pin_moves_along_the_slot_and_its_force_is_normal_to_it(float64):
    params = default_params()
    centres, angles, points, axes = map(np.asarray, geometry_along(params, jnp.asarray(ANGLES)))
    hip = BODIES.index("13")
    for column, joint in enumerate(JOINTS):
        if joint.axis != "normal":
            continue
        assert BODIES[joint.by] == "13"
        place = in_body(points[:, column], centres[:, hip], angles[:, hip])
        assert np.ptp(place[:, 1]) < 1e-12
        assert np.ptp(place[:, 0]) > float(params.crank)
        tilt = angles[:, hip]
        np.testing.assert_allclose(
            axes[:, column], np.stack([-np.sin(tilt), np.cos(tilt)], -1), atol=1e-12
        )


def test_the_joints_are_those_of_the_reference_file_and_two_slots(reference):
    names = [(f["on"], f["by"], f["axis"]) for f in reference["states"][0]["stick"]["joint_forces"]]
    assert len(JOINT_FORCES) == len(set(JOINT_FORCES)) == 68
    slots = {("10", "13", "normal"), ("10p", "13", "normal")}
    assert set(JOINT_FORCES) == set(names) | slots


def test_each_leg_has_as_many_forces_as_its_links_have_equations():
    for leg in (0, 1):
        columns = JOINT_FORCES[33 * leg : 33 * (leg + 1)]
        assert len(columns) == 3 * len(LEG_LINKS) == 33
        assert all(("p" in on) == bool(leg) for on, _, _ in columns)
    assert sorted(link for group in GROUPS for link in group) == list(LEG_LINKS)
