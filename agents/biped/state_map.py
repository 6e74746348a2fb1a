"""The biped's state in the coordinates that later rewards depend on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.grid import Axis, Grid, Place, Sheet
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedState
from stickslip.dynamics.checks import require_choice, require_kind, require_number
from stickslip.dynamics.numeric import require_one
from stickslip.dynamics.scene import Grip, Smoothed, Uniform
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import NUMBERS
from stickslip.envs.biped.state import BipedEnvState, Drawn, Totals

if TYPE_CHECKING:
    from stickslip.envs.biped.params import BipedEnvParams

REST, FORWARDS, BACKWARDS = range(3)
"""Sheets of a floor on which the foot slips."""
SLIDES = {"grip": (), "uniform": ("rest", "forwards", "backwards"), "smoothed": ("any velocity",)}
CELLS = {"rest": (144, 160), "slide": (36, 40)}
"""Of phase and crank rate."""
SPEEDS = (0.0, 0.01, 0.03, 0.07, 0.15, 0.3, 0.6)
"""Nodes of the foot's speed while it slides [m/s]."""
SLOWEST = 1e-5
"""The speed that stands for a slide that is just beginning or ending [m/s]."""
RATES = (-0.5, 2.5)
"""Crank rates that the usual grid covers, in commanded rates."""
MARKED = {"rest": (72, 72), "slide": (24, 24)}
"""The same cells where the way to a mark is a coordinate, too."""
WAYS = (0.005, 0.01, 0.02, 0.035, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.65, 0.95, 1.4, 2.0, 3.0, 4.5)
"""Nodes of the way to a mark, on both sides of it up to the fifth of these behind it [m]."""


@dataclass(frozen=True)
class BipedStates:
    """Phase and crank rate of a foot at rest, and with its velocity of one that slides.

    All functions of the phase have period pi, so the axis wraps. A foot at rest, one that slides
    forwards and one that slides backwards have a sheet each, since the friction differs however
    slow the slide; smoothed friction knows no rest and has one sheet for all. Steps taken, time and
    place on the floor change no later reward, so they are left out: the floor must be the same
    everywhere, and nothing but the start may be drawn. Of a task with a mark the way to it is a
    coordinate of every sheet, and where it lies may be drawn.

    floor: "grip", "uniform" or "smoothed". mark: whether the task has one.
    """

    floor: str
    mark: bool = field(default=False, repr=False)

    def __post_init__(self):
        require_choice("floor", self.floor, SLIDES)

    @classmethod
    def of(cls, env: BipedEnv, params: BipedEnvParams) -> BipedStates:
        """For a task. ValueError for one whose rewards depend on more."""
        require_kind("env", env, BipedEnv, "a BipedEnv")
        env.check_params(params)
        kinds = {Grip: "grip", Uniform: "uniform", Smoothed: "smoothed"}
        floor = kinds.get(type(params.scene.floor))
        if floor is None:
            raise ValueError(
                f"floor = {type(params.scene.floor).__name__}; accepted: a floor that is the same "
                "everywhere (Grip, Uniform, Smoothed)"
            )
        for name in ("friction", "mass", "payload", "mean_rate"):
            if getattr(params.randomisation, name) is not None:
                raise ValueError(
                    f"{name} is drawn; accepted: a task of which only the start is drawn (phase, "
                    "crank_rate)"
                )
        for name, rule in NUMBERS.items():
            require_one(name, getattr(params, name), **rule)
        return cls(floor, params.mark is not None)

    @property
    def axes(self) -> tuple[tuple[str, ...], ...]:
        """See StateMap."""
        way = ("to_go",) if self.mark else ()
        rest, slide = ("phase", "crank_rate", *way), ("phase", "crank_rate", *way, "foot_speed")
        if self.floor == "uniform":
            return (rest, slide, slide)
        return (rest,) if self.floor == "grip" else ((*rest, "foot_velocity"),)

    def grid(self, params: BipedEnvParams, fineness: float = 1.0) -> Grid:
        """See StateMap: crank rates of RATES, foot speeds up to 0.6 m/s."""
        require_number("fineness", fineness, low=0.0, strict=True, accepted="finite, > 0")
        commanded = float(params.mean_rate)
        rates = RATES[0] * commanded, RATES[1] * commanded

        def plane(kind: str) -> tuple[Axis, ...]:
            usual = MARKED if self.mark else CELLS
            phase, rate = (max(2, round(fineness * cells)) for cells in usual[kind])
            turn = Axis.even("phase", SUPPORT_START, SUPPORT_END, phase, periodic=True, unit="rad")
            rate = Axis.even("crank_rate", *rates, rate, unit="rad/s")
            return (turn, rate, _ways()) if self.mark else (turn, rate)

        if self.floor == "grip":
            return Grid((Sheet("rest", plane("rest")),))
        if self.floor == "smoothed":
            both = (*(-one for one in reversed(SPEEDS[1:])), *SPEEDS)
            velocity = Axis("foot_velocity", np.asarray(both), unit="m/s")
            return Grid((Sheet("any velocity", (*plane("slide"), velocity)),))
        speed = Axis("foot_speed", np.asarray(SPEEDS), unit="m/s")
        slide = (*plane("slide"), speed)
        return Grid(
            (Sheet("rest", plane("rest")), Sheet("forwards", slide), Sheet("backwards", slide))
        )

    def state(self, params: BipedEnvParams, place: Place) -> BipedEnvState:
        """See StateMap: the foot at its foothold, the first step of an episode."""
        phase, rate, *more = place.coordinates
        kind = phase.dtype
        zero, none = jnp.zeros((), kind), jnp.zeros((), jnp.int32)
        mark = more.pop(0) if self.mark else None
        velocity = more[0] if more else zero
        if self.floor == "uniform":
            speed = jnp.maximum(velocity, SLOWEST)
            signed = jnp.where(place.sheet == FORWARDS, speed, -speed)
            velocity = jnp.where(place.sheet == REST, zero, signed)
        commanded = jnp.asarray(params.mean_rate, kind)
        one = jnp.ones((), kind)
        nothing = Totals(*[zero] * len(Totals._fields))
        phase = jnp.clip(phase, SUPPORT_START, SUPPORT_END)
        return BipedEnvState(
            biped=BipedState(phase, none, rate, zero, velocity, zero),
            mode=jnp.sign(velocity).astype(jnp.int32),
            elapsed=none,
            over=jnp.zeros((), bool),
            drawn=Drawn(one, one, zero, commanded, mark=mark),
            totals=nothing,
            rests=nothing,
        )

    def place(self, grid: Grid, state: BipedEnvState) -> Place:
        """See StateMap."""
        phase, rate = jnp.asarray(state.biped.phase), jnp.asarray(state.biped.crank_rate)
        velocity = jnp.asarray(state.biped.foot_velocity)
        way = () if state.to_go is None else (state.to_go,)
        if self.floor == "grip":
            return grid.place(0, phase, rate, *way)
        if self.floor == "smoothed":
            return grid.place(0, phase, rate, *way, velocity)
        sheet = jnp.where(velocity > 0, FORWARDS, jnp.where(velocity < 0, BACKWARDS, REST))
        return grid.place(sheet, phase, rate, *way, jnp.abs(velocity))

    def leaving(self, params: BipedEnvParams) -> float:
        """See StateMap: a fall, and an episode walked backwards besides."""
        worst = params.fall_penalty + params.tracking_weight * params.time_limit
        return -float(np.asarray(worst))

    def most(self, params: BipedEnvParams) -> float:
        """See StateMap: tracking is at most its weight, and nothing else adds."""
        return float(np.asarray(params.tracking_weight * params.control_period))


def _ways() -> Axis:
    """Ways to a mark, closer together near it [m]."""
    behind = (-one for one in reversed(WAYS[:11]))
    return Axis("to_go", np.asarray((*behind, 0.0, *WAYS)), unit="m")
