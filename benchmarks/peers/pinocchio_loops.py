"""Pinocchio: the tree of mechanism.py with twelve point constraints, from Python.

`constraintDynamics` solves the constrained accelerations exactly (no softness), without contact or
friction: the supporting foot is part of the world, so only the sticking case can be asked. Time
stepping is the caller's; classical Runge-Kutta here, a Python call for each of the four stages.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from benchmarks.peers.cases import DURATION, SAMPLES, TORQUE, Case, Measured, load, measured
from benchmarks.peers.mechanism import LOOPS, SLOT, TREE, Mechanism, mechanism
from stickslip.dynamics.biped import BODIES, BipedParams

NAME = "Pinocchio"
STEPS = (10, 20, 40, 80, 160, 320, 640)
CORRECTION = 1e2
"""Stiffness of the correction that keeps the loops closed [1/s^2]."""


class Linkage:
    """Pinocchio's model, its constraints, and Runge-Kutta steps of the crank under a torque."""

    def __init__(self, machine: Mechanism):
        pinocchio, begun = load("pinocchio"), time.perf_counter()
        self.pin = pinocchio
        self.crank_angle = machine.crank_angle
        self.model = pinocchio.Model()
        self.model.gravity.linear = np.array([0.0, 0.0, -machine.gravity])
        joints, origins = self._tree(machine)
        self.constraints = pinocchio.StdVec_RigidConstraintModel()
        self.constraints.extend(self._loops(machine, joints, origins))
        self.crank = self.model.joints[joints["8"]].idx_v
        self.data = self.model.createData()
        self.loop_data = pinocchio.StdVec_RigidConstraintData()
        self.loop_data.extend([one.createData() for one in self.constraints])
        pinocchio.initConstraintDynamics(self.model, self.data, self.constraints, self.loop_data)
        self.proximal = pinocchio.ProximalSettings(1e-10, 1e-10, 20)
        self.build = time.perf_counter() - begun

    def _tree(self, machine: Mechanism) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        pin = self.pin
        turn = pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0]))
        joints, origins = {"1": 0}, {"1": np.zeros(2)}
        for body, parent, name in TREE:
            place = machine.pin(name, body if body != "13" else parent)
            joint, at = joints[parent], place - origins[parent]
            if name == SLOT:
                slide = pin.JointModelPrismaticUnaligned(_space(machine.slot))
                joint = self.model.addJoint(joint, slide, _placed(pin, at), f"slot{body}")
                at = np.zeros(2)
            joint = self.model.addJoint(joint, turn, _placed(pin, at), f"pin{body}")
            index = BODIES.index(body)
            inertia = machine.inertia[index] * np.eye(3)
            lever = _space(machine.centre[index] - place)
            content = pin.Inertia(float(machine.mass[index]), lever, inertia)
            self.model.appendBodyToJoint(joint, content, pin.SE3.Identity())
            joints[body], origins[body] = joint, place
        return joints, origins

    def _loops(self, machine: Mechanism, joints: dict, origins: dict) -> list:
        pin = self.pin
        loops = []
        for one, other, name in LOOPS:
            place = machine.pin(name, one)
            loop = pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D,
                self.model,
                joints[one],
                _placed(pin, place - origins[one]),
                joints[other],
                _placed(pin, place - origins[other]),
                pin.ReferenceFrame.LOCAL,
            )
            gains = pin.BaumgarteCorrectorParameters(CORRECTION, 2 * CORRECTION**0.5)
            loop.setBaumgarteCorrectorParameters(gains)
            loops.append(loop)
        return loops

    def acceleration(self, q: np.ndarray, v: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Joint accelerations with the loops closed."""
        found = self.pin.constraintDynamics(
            self.model, self.data, q, v, torque, self.constraints, self.loop_data, self.proximal
        )
        return np.array(found)

    def walk(self, steps: int) -> np.ndarray:
        """Crank angles at the samples: classical Runge-Kutta steps from rest."""
        q, v, dt = self.pin.neutral(self.model), np.zeros(self.model.nv), DURATION / steps
        torque = np.zeros(self.model.nv)
        torque[self.crank] = TORQUE
        angles = []
        for step in range(1, steps + 1):
            a1 = self.acceleration(q, v, torque)
            v2 = v + dt / 2 * a1
            a2 = self.acceleration(q + dt / 2 * v, v2, torque)
            v3 = v + dt / 2 * a2
            a3 = self.acceleration(q + dt / 2 * v2, v3, torque)
            v4 = v + dt * a3
            a4 = self.acceleration(q + dt * v3, v4, torque)
            q = q + dt / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            if step % (steps // SAMPLES) == 0:
                angles.append(self.crank_angle + q[self.crank])
        return np.array(angles)


def measure(case: Case, quick: bool) -> Iterator[Measured]:
    """Every step size on the sticking case; nothing on others."""
    if case.friction is not None:
        return
    linkage = Linkage(mechanism(BipedParams.from_bars(dtype=np.float64)))
    for steps in STEPS[: 6 if quick else None]:
        setting = f"constraintDynamics, RK4, {1e3 * DURATION / steps:.3g} ms, from Python"
        run = partial(linkage.walk, steps)
        yield measured(NAME, case, setting, run, 2 if quick else 5, linkage.build)


def _space(plane: np.ndarray) -> np.ndarray:
    return np.array([plane[0], 0.0, plane[1]])


def _placed(pin: Any, plane: np.ndarray) -> Any:
    return pin.SE3(np.eye(3), _space(plane))
