"""Creep of a contact that sticks: a box on a slope in MuJoCo, the biped's foot in stickslip."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate

SLOPE, FRICTION = 0.1, 0.5
"""Slope of the floor and coefficient of friction: a fifth of the friction is used."""
TIMESTEP = 0.002
"""MuJoCo's default [s]."""
SETTLE, DURATION = 2.0, 10.0
"""Time before the creep is measured, and time over which it is [s]."""
SOLVERS = (("pyramidal", 1, 0), ("elliptic", 1, 0), ("pyramidal", 10, 10), ("elliptic", 10, 10))
"""MuJoCo's cone, impratio and noslip iterations; its defaults come first."""
BOX = """
<mujoco>
  <option timestep="{timestep}" cone="{cone}" impratio="{impratio}" noslip_iterations="{noslip}"
    gravity="{along} 0 {down}"/>
  <worldbody>
    <geom type="plane" size="5 5 0.1" friction="{friction} 0.005 0.0001"/>
    <body pos="0 0 0.05">
      <freejoint/>
      <geom type="box" size="0.1 0.1 0.05" mass="1" friction="{friction} 0.005 0.0001"/>
    </body>
  </worldbody>
</mujoco>
"""


def creep_rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Speed [um/s] of a contact whose friction suffices."""
    mujoco: Any = import_module("mujoco")
    for cone, impratio, noslip in SOLVERS:
        yield {
            "contact": "box on a slope",
            "program": f"MuJoCo {mujoco.__version__}",
            "setting": f"{cone} cone, impratio {impratio}, noslip_iterations {noslip}",
            "creep": _creep_of_box(mujoco, cone, impratio, noslip, DURATION / (10 if quick else 1)),
        }
    yield {
        "contact": "foot of the biped",
        "program": "stickslip",
        "setting": "default",
        "creep": _creep_of_foot(),
    }


def _creep_of_box(mujoco: Any, cone: str, impratio: int, noslip: int, duration: float) -> float:
    angle, gravity = np.arctan(SLOPE), 9.81
    model = mujoco.MjModel.from_xml_string(
        BOX.format(
            timestep=TIMESTEP,
            cone=cone,
            impratio=impratio,
            noslip=noslip,
            along=gravity * np.sin(angle),
            down=-gravity * np.cos(angle),
            friction=FRICTION,
        )
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(SETTLE / TIMESTEP))
    start = float(data.qpos[0])
    mujoco.mj_step(model, data, nstep=round(duration / TIMESTEP))
    return 1e6 * (float(data.qpos[0]) - start) / duration


def _creep_of_foot() -> float:
    """Largest speed of the foot [um/s] until it slips: 0.69 s under 1 N m at a friction of 0.4."""
    scene = Scene.uniform(0.4, 0.4)
    walk = simulate(BipedParams.from_bars(), scene, BipedState(phase=np.pi / 2), 1.0, 0.69, 0.01)
    return 1e6 * float(jnp.max(jnp.abs(walk.states.foot_velocity)))
