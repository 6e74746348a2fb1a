"""The biped's environment, moved by MuJoCo: both feet touch the floor and are free to lift."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.exchange import files
from stickslip.dynamics.biped import SUPPORT_START, BipedState, Contact
from stickslip.dynamics.biped.model import loaded_params
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.dynamics.scene import Floor, Grip, Patches
from stickslip.dynamics.status import Status
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.state import HOLDS, BipedEnvState, drawn_robot

if TYPE_CHECKING:
    from jaxtyping import Array, Float


FALLEN = 0.5
"""Angle of the supporting foot from the floor beyond which the biped has toppled [rad]."""
ON_CONE = 0.99
"""Share of the friction beyond which a foot slides, since a contact that sticks creeps, too."""
MOST_ENGINES = 1024
"""Robots whose models are kept."""


@pytree_dataclass
class MujocoState(BipedEnvState):
    """State of an episode. engine: MuJoCo's positions, velocities and accelerations in a row, each
    the sum of two numbers, since MuJoCo computes in double precision."""

    engine: Float[Array, "2 n"]


@dataclass(frozen=True)
class MujocoBiped(BipedEnv):
    """BipedEnv on the model of `mjcf`: observation and reward are functions of MuJoCo's state.

    The supporting foot is the one whose crank angle is in the support phase. MuJoCo has one
    coefficient of friction: the static one under each ankle. A foot slides (mode) where its force
    is on the friction cone. TOPPLE: the supporting foot has turned by 0.5 rad; a foot that lifts
    off ends nothing. Fidelity and integrator count in what is computed of the phase alone.
    swing_contact: whether the swinging foot touches the floor, too.
    """

    swing_contact: bool = True

    def reset_env(self, key, params):
        obs, state = super().reset_env(key, params)
        robot = loaded_params(drawn_robot(state.drawn, params))
        places, rates = files.joints(robot, state.biped.phase, state.biped.crank_rate)
        foot = jnp.zeros(3, places.dtype)
        start = jnp.concatenate([foot, places, foot, rates, foot, jnp.zeros_like(rates)])
        return obs, MujocoState(**vars(state), engine=jnp.stack([start, jnp.zeros_like(start)]))

    def motion(self, state: Any, robot, scene, drive, period, params):
        one: Any = jax.ShapeDtypeStruct((), period.dtype)
        whole: Any = jax.ShapeDtypeStruct((), jnp.int32)
        shapes = (
            jax.ShapeDtypeStruct(state.engine.shape, state.engine.dtype),
            BipedState(one, whole, one, one, one, one),
            Contact(*[one] * 3, *[whole] * 3, *[one] * 4, joint_forces=None, events=None),
        )
        engine, biped, contact = jax.pure_callback(
            partial(_move, shapes, self.swing_contact),
            shapes,
            files.mechanism(loaded_params(robot)),
            scene.floor,
            state.engine,
            *(robot.step_length, drive.torque),
            *(np.inf if drive.max_power is None else drive.max_power, period),
            params.max_crank_rate,
            vmap_method="sequential",
        )
        status = contact.status
        if scene.steps == "one":
            ended = (status == Status.OK) & (biped.steps != state.biped.steps)
            status = jnp.where(ended, Status.STEP_COMPLETE, status).astype(status.dtype)
        biped = replace(biped, time=state.biped.time + period)
        return replace(state, biped=biped, engine=engine), replace(contact, status=status)


def moved_by(env: BipedEnv, program: str) -> BipedEnv:
    """See Machine."""
    import_module(program)
    return MujocoBiped(**{one.name: getattr(env, one.name) for one in fields(env)})


class Engine:
    """MuJoCo's model of one robot, and its data, which every control period sets anew."""

    def __init__(self, machine: files.Mechanism):
        self.mujoco: Any = import_module("mujoco")
        self.model = self.mujoco.MjModel.from_xml_string(files.mjcf(machine, friction=0.0))
        self.data = self.mujoco.MjData(self.model)
        self.crank = int(self.model.joint(files.joint_of("8")).qposadr[0])
        self.feet = [self.model.body(files.name_of(foot)).id for foot in files.FEET]
        balls = [[f"{files.name_of(foot)}_{end}" for end in ("heel", "toe")] for foot in files.FEET]
        self.balls = [[self.model.geom(name).id for name in names] for names in balls]

    @property
    def angle(self) -> float:
        """Crank angle of the first leg [rad]."""
        return SUPPORT_START + float(self.data.qpos[self.crank])

    def restore(self, state: np.ndarray, period: float) -> int:
        """Set the state and the time step; return the number of time steps in a period."""
        data = self.data
        data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = np.split(state, 3)
        count = max(1, round(period / files.Settings.timestep))
        self.model.opt.timestep = period / count
        self.mujoco.mj_forward(self.model, data)
        return count

    def state(self) -> np.ndarray:
        """Positions, velocities and accelerations in a row."""
        return np.concatenate([self.data.qpos, self.data.qvel, self.data.qacc_warmstart])

    def ground(self, leg: int) -> tuple[float, float, float]:
        """Friction and normal force on a foot [N], and their centre from the ankle [m]."""
        data, total, moment, force = self.data, np.zeros(3), 0.0, np.zeros(6)
        for i, contact in enumerate(data.contact):
            if contact.geom2 in self.balls[leg]:
                self.mujoco.mj_contactForce(self.model, data, i, force)
                push = contact.frame.reshape(3, 3).T @ force[:3]
                total += push
                moment += push[2] * (contact.pos[0] - data.xpos[self.feet[leg], 0])
        return total[0], total[2], moment / total[2] if total[2] > 0 else 0.0

    def status(self, leg: int, max_rate: float) -> Status:
        """Whether the walk goes on."""
        if not np.isfinite(self.state()).all():
            return Status.NON_FINITE
        if abs(self.data.qvel[self.crank]) > max_rate:
            return Status.RUNAWAY
        along = self.data.xmat[self.feet[leg]].reshape(3, 3)[:, 0]
        return Status.TOPPLE if np.arctan2(abs(along[2]), along[0]) > FALLEN else Status.OK


_ENGINES: dict[bytes, Engine] = {}


def engine_of(machine: files.Mechanism) -> Engine:
    """The engine of a robot, made once."""
    key = b"".join(leaf.tobytes() for leaf in jax.tree.leaves(machine))
    if key not in _ENGINES:
        if len(_ENGINES) >= MOST_ENGINES:
            _ENGINES.clear()
        _ENGINES[key] = Engine(machine)
    return _ENGINES[key]


def friction_at(floor: Floor, place: float) -> float:
    """Static coefficient of friction at a place of the floor [m]."""
    if isinstance(floor, Grip):
        return HOLDS
    if not isinstance(floor, Patches):
        return float(floor.mu_static)
    return float(floor.mu_static[np.searchsorted(floor.edges, place, side="right")])


def leg_of(crank_angle: float) -> int:
    """The supporting leg at a crank angle [rad]: 0, or 1 where it is the second one."""
    return int((crank_angle - SUPPORT_START) // np.pi) % 2


def _move(shapes, swing_contact, machine, floor, state, *numbers):
    """One control period in MuJoCo: state, biped and contact, of the arguments alone."""
    machine, floor, state = jax.tree.map(np.asarray, (machine, floor, state))
    step_length, torque, power, period, max_rate = map(float, numbers)
    engine = engine_of(machine)
    data, angles, ankles, torques = engine.data, [], [], []
    for _ in range(engine.restore(state.astype(float).sum(0), period)):
        most = power / max(abs(data.qvel[engine.crank]), 1e-9)
        torques.append(np.clip(torque, -most, most))
        data.ctrl[0] = torques[-1]
        swinging = engine.balls[1 - leg_of(engine.angle)]
        for foot, balls in zip(engine.feet, engine.balls, strict=True):
            engine.model.geom_friction[balls, 0] = friction_at(floor, data.xpos[foot, 0])
            engine.model.geom_conaffinity[balls] = swing_contact or balls != swinging
        angles.append(engine.angle)
        engine.mujoco.mj_step(engine.model, data)
        ankles.append(data.xpos[engine.feet, 0])  # of the same instant as the angle
        if not abs(data.qvel[engine.crank]) < max_rate:
            break
    engine.mujoco.mj_forward(engine.model, data)
    turns = np.diff([*angles, engine.angle])
    slides = np.diff([*ankles, data.xpos[engine.feet, 0]], axis=0)
    steps, leg = int((engine.angle - SUPPORT_START) // np.pi), leg_of(engine.angle)
    ankle, velocity = data.xpos[engine.feet[leg], 0], slides[-1, leg] / engine.model.opt.timestep
    friction, normal, zmp = engine.ground(leg)
    held = abs(friction) < ON_CONE * friction_at(floor, ankle) * normal
    mode = 0 if held else int(np.sign(velocity))
    slid = np.abs(slides)[range(len(angles)), [leg_of(angle) for angle in angles]].sum()
    work, status = np.multiply(torques, turns), engine.status(leg, max_rate)
    works: Any = work.sum(), np.maximum(work, 0.0).sum()
    contact: Any = friction, normal, zmp, mode, status, 0, slid, torques[-1], *works, None, None
    biped = engine.angle - steps * np.pi, steps, data.qvel[engine.crank]
    biped += ankle - steps * step_length, velocity, 0.0
    exact = engine.state()
    rounded = exact.astype(state.dtype)
    found = np.stack([rounded, exact - rounded]), BipedState(*biped), Contact(*contact)
    return jax.tree.map(lambda shape, value: np.asarray(value, shape.dtype), shapes, found)
