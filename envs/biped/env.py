"""BipedEnv: PASIBOT asked to walk at a commanded speed on a floor it may slip on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, floor_position
from stickslip.dynamics.biped import contact as contacts
from stickslip.dynamics.biped.recommendation import setting_of
from stickslip.dynamics.biped.settings import Fidelity, Integrator, Setting, require_fidelity
from stickslip.dynamics.biped.simulation import stepped
from stickslip.dynamics.checks import require_integer, require_kind, require_known
from stickslip.dynamics.pytrees import compensated, require_one
from stickslip.dynamics.scene import Grip, Patches, Scene
from stickslip.dynamics.status import Status
from stickslip.envs.biped import state as episode
from stickslip.envs.biped.params import (
    CONTROL_PERIOD,
    OPTIONS,
    BipedEnvParams,
    Randomisation,
    episode_params,
    make_params,
    scene_from_plain,
)
from stickslip.envs.functional import HALF, FunctionalEnv, with_keywords_of, with_tuples

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped import BipedModel, Contact


MAX_FOOT_VELOCITY = 10.0
"""Beyond this the observation is clipped [m/s]."""
MAX_SIGHT = 10.0
"""Clip of the observed distance to the next patch, or to a mark [m]."""
MAX_FRICTION = 10.0
"""Clip of the observed friction coefficient [-]."""
MOST_DELAY = 50
"""Most control periods from an action to its torque."""


def _number(reward: Any, dtype: Any) -> Float[Array, ""]:
    """What reward_of returns; ValueError for anything but a number."""
    shape = None if reward is None else np.shape(reward)
    if shape != ():
        raise ValueError(f"reward_of gave {shape}; accepted: a number")
    return jnp.asarray(reward, dtype)


@dataclass(frozen=True)
class BipedEnv(FunctionalEnv[episode.BipedEnvState, BipedEnvParams]):
    """A biped with one motor walks at a commanded speed without slipping or wasting energy.

    One step is one control period (0.02 s) at constant torque. `stickslip.dynamics.biped` computes
    the motion with friction switching: rigid links, no contact of the swinging foot, no friction in
    the pins. The episode continues while the model's status allows it.

    ## Action
    | index | name | range | meaning |
    | --- | --- | --- | --- |
    | 0 | torque | [-1, 1] | motor torque on the crank, times `torque_limit` (4 N m) |

    Actions beyond the range saturate. info["torque"] is the applied torque [N m]. `max_power` caps
    |torque x crank rate|; info has the torque at the step's end. With a `delay` the motor applies
    the action of so many control periods before, and no torque until the first arrives.

    ## Observation
    | entry | unit | range | when |
    | --- | --- | --- | --- |
    | cos 2 theta, of the supporting leg's crank angle | - | [-1, 1] | always |
    | sin 2 theta | - | [-1, 1] | always |
    | crank rate | rad/s | +- `max_crank_rate` | `see_motion` |
    | velocity of the foot over the floor | m/s | +- 10, clipped | `see_motion` |
    | sticking: 1 while the foot is at rest on the floor, else 0 | - | {0, 1} | `see_motion` |
    | commanded mean crank rate | rad/s | [0, `max_crank_rate`] | always |
    | distance of the mark ahead of the centre of mass | m | +- 10, clipped | `mark` |
    | distance to the next patch of floor ahead | m | [0, 10], 10 if none | `see_patch`, patches |
    | its static friction coefficient | - | [0, 10] | `see_patch`, patches |
    | static friction coefficient under the foot | - | [0, 10] | `see_friction` |
    | kinetic friction coefficient under the foot | - | [0, 10] | `see_friction` |

    All functions of the angle have period pi, since the legs take turns: hence 2 theta. Friction is
    hidden by default, motion (`see_motion`) is seen; without it an encoder's angle is all. With
    `encoder_noise` the observed theta has a normal error, independent in each step.

    ## Reward
    The sum of these rates, times the control period. A perfect episode of 10 s earns about 10 times
    `tracking_weight`. With the commanded speed v = commanded rate x step length / pi:
      tracking  + tracking_weight x max(-1, 1 - |walking speed - v| / v)
      slip      - slip_weight x (distance slid per second) / v
      energy    - energy_weight x (positive motor work + losses, per second) / (m g v)
      fall      - fall_penalty, once, when the episode terminates (not for a one-step scene's end)
    Losses are the copper loss, and with an `efficiency` (1 / efficiency - 1) x positive motor work.
    The walking speed is the mean speed of the centre of mass over the control period. To keep it
    constant needs no friction, so a perfect score is possible on any floor.
    With a `mark` [m ahead of the centre of mass at the start] the distance d to it, either way,
    replaces the speed, and v only scales slip and energy:
      tracking  + tracking_weight x mark_width / (mark_width + d)
    info has the terms as `reward_tracking`, `reward_slip`, `reward_energy` and `reward_fall`, and
    their physical quantities. Override `reward_of` for another reward.

    ## Start
    At rest with both feet on the floor (theta = pi/2), unless `Randomisation` draws phase, crank
    rate, friction, masses, payload, commanded rate, the place of the mark or a robot. With
    `command_interval` the commanded rate is drawn again after each interval; the last step of an
    interval is rewarded by its own command.

    ## Options of a reset
    `reset(options={...})` of the adapters, for one episode; a given option is not drawn:
    | option | unit | accepted |
    | --- | --- | --- |
    | phase | rad | pi/2 to 3 pi/2 |
    | crank_rate | rad/s | finite |
    | mean_rate | rad/s | > 0 |
    | mark | m | > 0, where the task has a mark |

    ## End
    Terminated: topple, lift-off, runaway (|crank rate| > `max_crank_rate`), no solution, non-finite
    (info["status"], a Status), or the end of a one-step scene. Truncated: at `time_limit` (10 s).

    ## Info
    Of the step: cost, what a constraint limits, no part of the reward: slid [m], and 1 more if it
    ends in a fall; status, torque [N m], walking_speed [m/s], walked (by the centre of mass) and
    slid [m], positive_work and copper_loss [J], friction_force and normal_force [N], zmp [m from
    the ankle], final_obs, autoreset. Of the episode so far: episode_return, episode_length [steps],
    episode_walked and episode_slid [m], episode_energy [J], episode_mean_rate [rad/s].

    Static choices: autoreset, see_friction, see_patch, see_motion, delay; shield, a margin (0.02)
    with which the nearest torque without slip or fall is applied (`safe_torque`; it knows floor and
    masses, and info["shield"] is its status); and speed against accuracy, either by the setting
    ("fast", "balanced", "exact" or a Setting, whose dt is the integrator's longest step in the
    standard control period of 0.02 s), or by fidelity of the inertia functions, substeps of the
    integrator in a control step and the switches located in it (max_events). Version 0.
    """

    setting: str | Setting | None = None
    fidelity: Fidelity = "table"
    substeps: int = 1
    max_events: int = 3
    autoreset: str = "same_step"
    see_friction: bool = False
    see_patch: bool = False
    shield: float | None = field(default=None, repr=False)  # a task's digest is of the repr
    see_motion: bool = field(default=True, repr=False)
    delay: int = field(default=0, repr=False)

    action_names = ("torque",)
    params_kind, state_kind = BipedEnvParams, episode.BipedEnvState
    option_names = OPTIONS
    readers: ClassVar = {
        "robot": lambda bars: BipedParams.from_bars(**bars),
        "scene": scene_from_plain,
        "randomisation": lambda given: Randomisation(**with_tuples(given)),
    }

    def __post_init__(self):
        super().__post_init__()
        require_fidelity(self.fidelity)
        RK4Split(self.substeps, self.max_events)
        if self.setting is not None:
            setting_of(self.setting)
            by_hand = (self.fidelity, self.substeps, self.max_events)
            if by_hand != ("table", 1, 3):
                raise ValueError(
                    f"setting = {self.setting!r} beside fidelity, substeps, max_events = "
                    f"{by_hand}; accepted: a setting alone, or these without a setting"
                )
        for name in ("see_friction", "see_patch", "see_motion"):
            require_kind(name, getattr(self, name), bool, "True or False")
        require_integer("delay", self.delay, low=0, high=MOST_DELAY)
        if self.shield is not None:
            accepted = "None, or a share from 0 up to 1"
            require_one("shield", self.shield, low=0.0, high=1.0, accepted=accepted)

    def episode_params(self, params: BipedEnvParams, options: Mapping[str, Any]) -> BipedEnvParams:
        return episode_params(super().episode_params(params, options), options)

    @property
    def default_params(self) -> BipedEnvParams:
        """Default robot, static and kinetic friction 0.06 and 0.05, commanded 3 rad/s."""
        return self.make_params()

    @with_keywords_of(make_params)
    def make_params(self, **changes: Any) -> BipedEnvParams:
        """Parameters with some entries changed: robot, scene (a Scene, or a name of
        stickslip.dynamics.names.SCENES), randomisation, dtype or any number of BipedEnvParams.
        ValueError naming the field or name. The dtype is the setting's unless given."""
        require_known(changes, self.parameter_names(), "parameter of BipedEnv")
        if self.setting is None:
            return make_params(self.fidelity, **changes)
        setting = setting_of(self.setting)
        own = "dtype" not in changes and setting.dtype == "float64"
        if own and jax.dtypes.canonicalize_dtype(float) != jnp.float64:
            raise ValueError(
                f"setting = {self.setting!r} computes in float64, which JAX has switched off; "
                'accepted: jax.config.update("jax_enable_x64", True) at the start of the program, '
                "dtype=float32 for less accuracy, or another setting"
            )
        return make_params(setting.fidelity, **{"dtype": setting.dtype, **changes})

    @property
    def integrator(self) -> Integrator:
        """The integrator of one control step."""
        if self.setting is None:
            return RK4Split(self.substeps, self.max_events)
        return setting_of(self.setting).integrator_over(CONTROL_PERIOD)

    def reset_env(self, key, params):
        drawn, phase, rate = episode.draw(key, params)
        dtype = rate.dtype
        zero, none = jnp.zeros((), dtype), jnp.zeros((), jnp.int32)
        nothing = episode.Totals(*[zero] * len(episode.Totals._fields))
        state = episode.BipedEnvState(
            biped=BipedState(phase, none, rate, zero, zero, zero),
            mode=none,
            elapsed=none,
            over=jnp.zeros((), bool),
            drawn=drawn,
            totals=nothing,
            rests=nothing,
            asked=(zero,) * self.delay,
        )
        return self._observe(state, params), state

    def step_env(
        self, state: episode.BipedEnvState, action: Float[Array, " act"], params: BipedEnvParams
    ) -> tuple[Float[Array, " obs"], episode.BipedEnvState, Array, Array, Array, dict[str, Any]]:
        dtype = state.biped.crank_rate.dtype
        asked = (params.torque_limit * action[0]).astype(dtype)
        torque, *queue = (*state.asked, asked)
        period = jnp.asarray(params.control_period, dtype)
        robot = episode.drawn_robot(state.drawn, params)
        scene = episode.drawn_scene(state.drawn, params)
        safety = {}
        if self.shield is not None:
            safe = episode.shielded(params, robot, scene, state.biped, torque, self.shield)
            torque, safety = safe.torque, {"shield": safe.status}
        power = None if params.max_power is None else jnp.asarray(params.max_power, dtype)
        drive = contacts.Torque(torque, power)
        moved, contact = self.motion(state, robot, scene, drive, period, params)
        biped = moved.biped
        status, begun = contact.status, torque
        if params.max_power is not None:
            begun, torque = drive.at(state.biped.crank_rate), contact.torque
        torque = jnp.where(status == Status.NON_FINITE, 0.0, torque)  # it did nothing
        elapsed = state.elapsed + 1
        duration = elapsed.astype(dtype) * period
        timed_out = duration >= params.time_limit - HALF * period
        square = torque**2 if params.max_power is None else (begun**2 + torque**2) / 2
        loss = params.copper_loss * square * period
        outcome = episode.outcome_of(robot, state.biped, biped, contact, loss, params.efficiency)
        status, outcome = episode.marked(status, outcome)
        to_go = None if state.to_go is None else state.to_go - outcome.walked
        given = params, robot, state.drawn, outcome, episode.fell(status), period
        terms = episode.reward_terms(*given, to_go)
        status, terms = episode.marked(status, terms)
        terminated = status > Status.SLIP_ONSET
        info = terms | {"status": status, "torque": torque, **outcome.info(period)}
        info |= episode.ground_force(contact, status) | safety
        info["cost"] = episode.cost_of(outcome.slid, status)
        reward = _number(self.reward_of(state, action, info, params), dtype)
        added = episode.Totals(reward, outcome.turned, outcome.walked, outcome.slid, outcome.energy)
        totals, rests = compensated(state.totals, state.rests, added)
        after = replace(
            moved,
            mode=contact.mode,
            elapsed=elapsed,
            over=terminated | timed_out,
            drawn=episode.commanded_at(state.drawn, duration),
            totals=totals,
            rests=rests,
            asked=tuple(queue),
        )
        info |= totals.info(elapsed, duration)
        obs, truncated = self._observe(after, params), timed_out & ~terminated
        return obs, after, reward, terminated, truncated, info

    def motion(
        self,
        state: episode.BipedEnvState,
        robot: BipedModel,
        scene: Scene,
        drive: contacts.Torque,
        period: Float[Array, ""],
        params: BipedEnvParams,
    ) -> tuple[episode.BipedEnvState, Contact]:
        """The state after a torque over a period [s], and the contact; the rest of a step,
        its reward among it, follows from them. `stickslip.agents.exchange` has another motion."""
        how = self.integrator, self.fidelity, robot, scene, state.biped, drive, period
        biped, contact = stepped(*how, params.max_crank_rate)
        return replace(state, biped=biped), contact

    def reward_of(
        self,
        state: episode.BipedEnvState,
        action: Float[Array, " act"],
        info: dict[str, Array],
        params: BipedEnvParams,
    ) -> Float[Array, ""]:
        """The reward of a control step: the sum of the class's four terms, which info holds.

        For a reward of one's own override it in a subclass. state: before the step. info: the
        step's entries; those of the episode follow from what is returned here.
        """
        terms = [info[f"reward_{name}"] for name in ("tracking", "slip", "energy", "fall")]
        return sum(terms, start=jnp.zeros((), terms[0].dtype))

    def pictures(self, states, infos, params):
        """See FunctionalEnv (extra `viz`)."""
        from stickslip.envs.biped.picture import biped_frames, biped_picture
        from stickslip.envs.rendering.scene import paint

        drawn = jax.tree.map(lambda leaf: leaf[0], states.drawn)
        robot = episode.drawn_robot(drawn, params).params
        return partial(paint, biped_picture(biped_frames(states, infos, params), robot))

    def observation_bounds(self, params):
        """See FunctionalEnv; entries as in the class docstring."""
        fastest = float(np.max(np.asarray(params.max_crank_rate)))
        motion = [(-fastest, fastest), (-MAX_FOOT_VELOCITY, MAX_FOOT_VELOCITY), (0, 1)]
        rows = [(-1, 1), (-1, 1), *(motion if self.see_motion else ()), (0, fastest)]
        rows += [] if params.mark is None else [(-MAX_SIGHT, MAX_SIGHT)]
        if self.see_patch and isinstance(params.scene.floor, Patches):
            rows += [(0, MAX_SIGHT), (0, MAX_FRICTION)]
        if self.see_friction and not isinstance(params.scene.floor, Grip):
            rows += [(0, MAX_FRICTION)] * 2
        low, high = np.asarray(rows, np.float64).T
        return low, high

    def _observe(
        self, state: episode.BipedEnvState, params: BipedEnvParams
    ) -> Float[Array, " obs"]:
        biped = state.biped
        dtype = state.biped.crank_rate.dtype
        fastest = params.max_crank_rate
        angle = episode.seen_angle(state, params)
        entries = [jnp.cos(2 * angle), jnp.sin(2 * angle)]
        if self.see_motion:
            entries += [
                jnp.clip(biped.crank_rate, -fastest, fastest),
                jnp.clip(biped.foot_velocity, -MAX_FOOT_VELOCITY, MAX_FOOT_VELOCITY),
                jnp.where(state.mode == 0, 1.0, 0.0),
            ]
        entries += [jnp.minimum(state.drawn.mean_rate, fastest)]
        if state.to_go is not None:
            entries += [jnp.clip(state.to_go, -MAX_SIGHT, MAX_SIGHT)]
        entries += self._sight(state, params)
        return jnp.stack([jnp.asarray(entry, dtype) for entry in entries])

    def _sight(self, state: episode.BipedEnvState, params: BipedEnvParams) -> list[Array]:
        """The floor's part of the observation."""
        floor = episode.drawn_scene(state.drawn, params).floor
        if isinstance(floor, Grip) or not (self.see_patch or self.see_friction):
            return []
        dtype = state.biped.crank_rate.dtype
        place = floor_position(episode.drawn_robot(state.drawn, params), state.biped)
        here = contacts.patch_at(floor, place, jnp.ones((), dtype))
        seen = []
        if self.see_patch and isinstance(floor, Patches):
            gap = contacts.edge_ahead(floor, here, jnp.ones((), dtype), dtype) - place
            ahead = jnp.minimum(here + 1, jnp.shape(floor.edges)[-1])
            mu_ahead = contacts.friction_on(floor, ahead, dtype).mu_static
            seen += [jnp.minimum(gap, MAX_SIGHT), jnp.minimum(mu_ahead, MAX_FRICTION)]
        if self.see_friction:
            under = contacts.friction_on(floor, here, dtype)
            seen += [jnp.minimum(mu, MAX_FRICTION) for mu in under]
        return seen
