"""The biped's state in the coordinates that later rewards depend on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.grid import Axis, Grid, Place, Sheet
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedState
from stickslip.dynamics.checks import require_kind, require_number
from stickslip.dynamics.pytrees import require_one
from stickslip.dynamics.scene import Grip, Uniform
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import NUMBERS
from stickslip.envs.biped.state import BipedEnvState, Drawn, Totals

if TYPE_CHECKING:
    from stickslip.envs.biped.params import BipedEnvParams

REST, FORWARDS, BACKWARDS = range(3)
"""Sheets of a floor on which the foot slips."""
SHEETS = {"grip": ("rest",), "uniform": ("rest", "forwards", "backwards")}
FLOORS = {Grip: "grip", Uniform: "uniform"}
CELLS = {"rest": (144, 160), "slide": (36, 40)}
"""Cells of phase and crank rate."""
SPEEDS = (0.0, 0.01, 0.03, 0.07, 0.15, 0.3, 0.6)
"""Nodes of the foot's speed while it slides [m/s]."""
SLOWEST = 1e-5
"""The speed that stands for a slide that is just beginning or ending [m/s]."""
RATES = (-0.5, 2.5)
"""Crank rates that the usual grid covers, in commanded rates."""


@dataclass(frozen=True)
class BipedStates:
    """Phase and crank rate of a foot at rest, and with its velocity of one that slides.

    All functions of the phase have period pi, so the axis wraps. A foot at rest, one that slides
    forwards and one that slides backwards have a sheet each, since the friction differs however
    slow the slide. Steps taken, time and place on the floor change no later reward, so they are
    left out: the floor must be the same everywhere, and nothing but the start may be drawn.

    floor: "grip" or "uniform".
    """

    floor: str

    def grid(self, params: BipedEnvParams, fineness: float = 1.0) -> Grid:
        """See StateMap: crank rates of RATES, foot speeds up to 0.6 m/s."""
        require_number("fineness", fineness, low=0.0, strict=True, accepted="finite, > 0")
        low, high = (share * float(params.mean_rate) for share in RATES)

        def sheet(name: str) -> Sheet:
            cells = CELLS["rest" if name == "rest" else "slide"]
            phase, rate = (max(2, round(fineness * count)) for count in cells)
            turn = Axis.even("phase", SUPPORT_START, SUPPORT_END, phase, periodic=True, unit="rad")
            plane = (turn, Axis.even("crank_rate", low, high, rate, unit="rad/s"))
            speed = Axis("foot_speed", np.asarray(SPEEDS), unit="m/s")
            return Sheet(name, plane if name == "rest" else (*plane, speed))

        return Grid(tuple(map(sheet, SHEETS[self.floor])))

    def state(self, params: BipedEnvParams, place: Place) -> BipedEnvState:
        """See StateMap: the foot at its foothold, the first step of an episode."""
        phase, rate, *speed = place.coordinates
        kind = phase.dtype
        zero, one = jnp.zeros((), kind), jnp.ones((), kind)
        none = jnp.zeros((), jnp.int32)
        velocity = zero
        if speed:
            quick = jnp.maximum(speed[0], SLOWEST)
            signed = jnp.where(place.sheet == FORWARDS, quick, -quick)
            velocity = jnp.where(place.sheet == REST, zero, signed)
        commanded = jnp.asarray(params.mean_rate, kind)
        nothing = Totals(*[zero] * len(Totals._fields))
        phase = jnp.clip(phase, SUPPORT_START, SUPPORT_END)
        return BipedEnvState(
            biped=BipedState(phase, none, rate, zero, velocity, zero),
            mode=jnp.sign(velocity).astype(jnp.int32),
            elapsed=none,
            over=jnp.zeros((), bool),
            drawn=Drawn(one, one, zero, commanded, mark=None),
            totals=nothing,
            rests=nothing,
        )

    def place(self, grid: Grid, state: BipedEnvState) -> Place:
        """See StateMap."""
        phase, rate = jnp.asarray(state.biped.phase), jnp.asarray(state.biped.crank_rate)
        if self.floor == "grip":
            return grid.place(0, phase, rate)
        velocity = jnp.asarray(state.biped.foot_velocity)
        sheet = jnp.where(velocity > 0, FORWARDS, jnp.where(velocity < 0, BACKWARDS, REST))
        return grid.place(sheet, phase, rate, jnp.abs(velocity))

    def leaving(self, params: BipedEnvParams) -> float:
        """See StateMap: a fall, and an episode walked backwards besides."""
        worst = params.fall_penalty + params.tracking_weight * params.time_limit
        return -float(np.asarray(worst))

    def most(self, params: BipedEnvParams) -> float:
        """See StateMap: tracking is at most its weight, and nothing else adds."""
        return float(np.asarray(params.tracking_weight * params.control_period))


def state_map(env: BipedEnv, params: BipedEnvParams) -> BipedStates:
    """See Machine. ValueError for a task whose rewards depend on more."""
    require_kind("env", env, BipedEnv, "a BipedEnv")
    env.check_params(params)
    kind = type(params.scene.floor)
    if kind not in FLOORS:
        raise ValueError(f"floor = {kind.__name__}; accepted: Grip or Uniform, the same everywhere")
    for name in ("friction", "mass", "payload", "mean_rate"):
        if getattr(params.randomisation, name) is not None:
            raise ValueError(
                f"{name} is drawn; accepted: a task of which only the start is drawn (phase, "
                "crank_rate)"
            )
    if params.mark is not None:
        raise ValueError("a task with a mark; accepted: one without")
    for name, rule in NUMBERS.items():
        require_one(name, getattr(params, name), **rule)
    return BipedStates(FLOORS[kind])
