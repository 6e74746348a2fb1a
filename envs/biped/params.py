"""Parameters of the biped environment: made, changed, and from options of a reset or JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks, pytrees
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedModel, BipedParams, prepare
from stickslip.dynamics.biped.settings import Fidelity
from stickslip.dynamics.biped.simulation import require_exchange
from stickslip.dynamics.scene import Grip, Scene, scene_of
from stickslip.envs import functional

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Real

    from stickslip.dynamics.biped.model import Inertia


SLACK = 1e-6
"""Tolerance of a phase at the end of its range, in single precision [rad]; least of what is > 0."""
DRAWS: dict[str, dict[str, Any]] = {
    "friction": {"low": 0.0},
    "mass": {"low": SLACK},
    "payload": {"low": 0.0},
    "mean_rate": {"low": SLACK, "accepted": "a finite rate > 0 [rad/s]"},
    "phase": {
        "low": SUPPORT_START - SLACK,
        "high": SUPPORT_END + SLACK,
        "accepted": "an angle within pi/2 to 3 pi/2 [rad]",
    },
    "crank_rate": {"accepted": "a finite rate [rad/s]"},
    "command_interval": {"low": SLACK},
    "mark": {"low": SLACK, "accepted": "a finite way > 0 [m]"},
    "robot": {"low": 0.0},
}
"""The rule of every draw."""
OPTIONS = ("phase", "crank_rate", "mean_rate", "mark")
"""Options of a reset: draws that no step reads."""


@pytrees.pytree_dataclass
class Randomisation:
    """Ranges (low, high) of a reset's uniform draws; None leaves a value as it is.

    friction: factor on every friction coefficient. mass: factor on every mass and inertia. payload:
    mass added to the hip [kg]. mean_rate [rad/s]. phase [rad], crank_rate [rad/s]: how the
    episode begins. command_interval: time after which the commanded rate is drawn anew, again and
    again [s]; one number for each episode. mark: way to the mark [m], of a task that has one.
    robot: places in a batch of robots [n], whole numbers from 0. What is None is not compiled in.
    """

    friction: functional.Range | None = None
    mass: functional.Range | None = None
    payload: functional.Range | None = None
    mean_rate: functional.Range | None = None
    phase: functional.Range | None = None
    crank_rate: functional.Range | None = None
    command_interval: functional.Range | None = None
    mark: functional.Range | None = None
    robot: functional.Range | None = None

    def validate(self) -> Randomisation:
        """Return self, or raise ValueError naming the range."""
        for one in fields(self):
            rule = DRAWS[one.name]
            low, high = rule.get("low", -np.inf), rule.get("high", np.inf)
            functional.require_range(one.name, getattr(self, one.name), low, high=high)
        if self.command_interval is not None and self.mean_rate is None:
            given = f"command_interval = {self.command_interval} without mean_rate"
            raise ValueError(f"{given}; accepted: with the range that commands are drawn from")
        return self


@pytrees.pytree_dataclass
class BipedEnvParams:
    """Parameters of BipedEnv, a pytree to vmap over. Build it with `BipedEnv.make_params`.

    robot: the model that is stepped; `robot.params` is the robot with the scene's payload.
    scene: floor, walk and payload. randomisation: what a reset draws. unit_payload: inertia of 1 kg
    on the hip, only if payloads are drawn; it follows from the others. A change of scene, robot or
    randomisation, by `replace` or `dataclasses.replace`, prepares what depends on it anew.
    torque_limit: torque at action 1 [N m]. control_period: time between actions [s].
    mean_rate: mean crank rate asked for [rad/s]. time_limit: of an episode [s].
    max_crank_rate: |crank rate| beyond which the episode ends as a runaway [rad/s].
    copper_loss: winding loss per torque squared [W / (N m)^2]. max_power: most |torque x crank
    rate| of the motor [W], None: any. efficiency: of motor and gear without the winding, of what
    drives the crank [-], None: 1; what brakes it gives nothing back. encoder_noise: standard
    deviation of the observed crank angle [rad], None: exact.
    tracking_weight, slip_weight, energy_weight, fall_penalty: of the reward's terms, see BipedEnv.
    mark: how far ahead of the centre of mass's start it is to stop [m], mark_width: how near to
    that half of the reward is earned [m]; None: it is to keep a speed. cost_limit: most that an
    episode is to cost in the mean, the sum of info["cost"] [m]; no step reads it; None: no limit.
    """

    robot: BipedModel
    scene: Scene
    randomisation: Randomisation
    torque_limit: pytrees.Numeric
    control_period: pytrees.Numeric
    mean_rate: pytrees.Numeric
    time_limit: pytrees.Numeric
    max_crank_rate: pytrees.Numeric
    copper_loss: pytrees.Numeric
    tracking_weight: pytrees.Numeric
    slip_weight: pytrees.Numeric
    energy_weight: pytrees.Numeric
    fall_penalty: pytrees.Numeric
    mark: Real[pytrees.Number, "..."] | None
    mark_width: Real[pytrees.Number, "..."] | None
    max_power: pytrees.Numeric | None = field(default=None, kw_only=True)
    efficiency: pytrees.Numeric | None = field(default=None, kw_only=True)
    cost_limit: pytrees.Numeric | None = field(default=None, kw_only=True)
    encoder_noise: pytrees.Numeric | None = field(default=None, kw_only=True)
    unit_payload: Inertia | None = field(init=False, repr=False)

    def __post_init__(self):
        checks.require_kind("robot", self.robot, BipedModel, "a BipedModel, as `prepare` makes it")
        if self.robot.load is not None:
            raise ValueError("robot carries a load; accepted: a BipedModel as `prepare` makes it")
        unit = None
        if pytrees.holds_numbers(self.robot.bare):
            carried = self.scene.payload if isinstance(self.scene, Scene) else self.robot.payload
            if not _same_number(self.robot.payload, carried):
                pytrees.settle(self, robot=replace(self.robot, payload=carried))
            if getattr(self.randomisation, "payload", None) is not None:
                unit = self.robot.unit_inertia()
        pytrees.settle(self, unit_payload=unit)

    def replace(self, **changes: Any) -> BipedEnvParams:
        """A copy with some fields changed, validated; ValueError for an unknown name.

        robot: a BipedModel, or a BipedParams, prepared with fidelity and type of the robot before.
        """
        checks.require_known(changes, [one.name for one in fields(self) if one.init])
        robot = changes.get("robot")
        if isinstance(robot, BipedParams):
            bare = robot.validate().astype(jnp.result_type(self.robot.bare.crank))
            changes["robot"] = BipedModel(bare, self.robot.payload, self.robot.fidelity)
        return replace(self, **_as_numbers(changes)).validate()

    @property
    def only_robot(self) -> BipedParams | None:
        """The robot of every episode, without a load; None where a reset draws one of several."""
        return self.robot.bare if self.randomisation.robot is None else None

    def shortened(self, steps: int) -> BipedEnvParams:
        """The parameters with a time limit of so many control steps."""
        return self.replace(time_limit=steps * self.control_period)

    def validate(self) -> BipedEnvParams:
        """Return self, or raise ValueError naming the field, the value and the accepted range."""
        kind = jnp.result_type(self.robot.own_mass)
        functional.require_numbers(self, NUMBERS | OPTIONAL, kind)
        checks.require_both(mark=self.mark, mark_width=self.mark_width)
        checks.require_kind("scene", self.scene, Scene, "a Scene")
        checks.require_kind("randomisation", self.randomisation, Randomisation, "a Randomisation")
        self.scene.validate()
        self.randomisation.validate()
        if self.randomisation.mark is not None and self.mark is None:
            raise ValueError(
                "mark is drawn in a task without one; accepted: with mark, which it takes the "
                "place of, and mark_width"
            )
        places, batch = self.randomisation.robot, np.shape(self.robot.own_mass)
        whole = not checks.is_concrete(places) or not np.any(np.asarray(places or 0) % 1)
        if places is not None and (len(batch) != 1 or not whole):
            accepted = "whole numbers, places in a batch of robots (n,)"
            accepted += f", not {batch}" if len(batch) != 1 else ""
            raise ValueError(f"robot = {checks.shown(places)}; accepted: {accepted}")
        functional.require_range("robot", places, 0.0, high=(*batch, 0)[0] - 1)
        if isinstance(self.scene.floor, Grip) and self.randomisation.friction is not None:
            raise ValueError("friction cannot be drawn on a grip floor; accepted: None")
        if checks.is_concrete(self.robot.closes) and not np.all(np.asarray(self.robot.closes)):
            raise ValueError("robot: its linkage cannot close; accepted: one that closes")
        even = self.robot.symmetric
        if not (checks.is_concrete(even) and np.all(np.asarray(even))):
            robot = self.robot if places is None else self.robot.member(jnp.argmin(even))
            require_exchange(robot.params, self.scene)  # says by how much it is not
        return self


NUMBERS: dict[str, functional.Rule] = dict.fromkeys(
    ("torque_limit", "control_period", "mean_rate", "time_limit", "max_crank_rate"),
    functional.POSITIVE,
)
NUMBERS |= dict.fromkeys(
    ("copper_loss", "tracking_weight", "slip_weight", "energy_weight", "fall_penalty"),
    functional.NON_NEGATIVE,
)
"""The rule of every number."""
_WAY: functional.Rule = {"low": 0.0, "strict": True, "accepted": "None, or a finite way > 0 [m]"}
OPTIONAL: dict[str, functional.Rule] = {
    "mark": _WAY,
    "mark_width": _WAY,
    "max_power": {"low": 0.0, "strict": True, "accepted": "None, or a finite power > 0 [W]"},
    "efficiency": {"low": 0.0, "strict": True, "high": 1.0, "accepted": "None, or above 0 up to 1"},
    "cost_limit": {"low": 0.0, "accepted": "None, or a finite cost >= 0 [m]"},
    "encoder_noise": {"low": 0.0, "accepted": "None, or a finite angle >= 0 [rad]"},
}
"""Rules of the numbers that may be None."""


def _as_numbers(given: dict[str, Any]) -> dict[str, Any]:
    """The entries with numbers as pytrees hold them; ValueError naming a bad one."""
    if "scene" in given:
        given["scene"] = scene_of(given["scene"]).validate()
    return functional.as_numbers(given, NUMBERS | OPTIONAL)


def _same_number(one: pytrees.Numeric | None, other: pytrees.Numeric | None) -> bool:
    """True if two payloads are known to be the same: one object, or equal in value and shape."""
    if one is None or other is None or not checks.is_concrete(one, other):
        return one is other
    return np.array_equal(np.asarray(one), np.asarray(other, np.asarray(one).dtype))


CONTROL_PERIOD = 0.02
"""Time from one action to the next [s], unless another is chosen."""

DEFAULT_SCENE = Scene.named("slippery")
"""Too slippery for a constant crank rate of 3 rad/s, which needs 0.08."""


def make_params(
    fidelity: Fidelity,
    *,
    robot: BipedParams | BipedModel | None = None,
    scene: Scene | str | None = None,
    randomisation: Randomisation | None = None,
    dtype: DTypeLike | None = None,
    torque_limit: pytrees.Numeric = 4.0,
    control_period: pytrees.Numeric = CONTROL_PERIOD,
    mean_rate: pytrees.Numeric = 3.0,
    time_limit: pytrees.Numeric = 10.0,
    max_crank_rate: pytrees.Numeric = 20.0,
    copper_loss: pytrees.Numeric = 0.5,
    tracking_weight: pytrees.Numeric = 1.0,
    slip_weight: pytrees.Numeric = 5.0,
    energy_weight: pytrees.Numeric = 0.5,
    fall_penalty: pytrees.Numeric = 5.0,
    mark: Real[pytrees.Number, "..."] | None = None,
    mark_width: Real[pytrees.Number, "..."] | None = None,
    max_power: pytrees.Numeric | None = None,
    efficiency: pytrees.Numeric | None = None,
    cost_limit: pytrees.Numeric | None = None,
    encoder_noise: pytrees.Numeric | None = None,
) -> BipedEnvParams:
    """Prepare the robot and gather the numbers; see BipedEnvParams for their meaning and units.

    robot: by default `BipedParams.from_bars()`; a BipedModel is prepared anew.
    """
    numbers = {name: one for name, one in locals().items() if name in NUMBERS | OPTIONAL}
    bare = robot.bare if isinstance(robot, BipedModel) else robot
    bare = BipedParams.from_bars() if bare is None else bare
    scene = DEFAULT_SCENE if scene is None else scene_of(scene)
    drawn = Randomisation() if randomisation is None else randomisation
    checks.require_kind("robot", bare, BipedParams, "None or a BipedParams")
    bare.validate()
    numbers = _as_numbers({"scene": scene, "randomisation": drawn} | numbers)
    bare = bare.astype(pytrees.float_kind(dtype, jnp.result_type(bare.mass)))
    model = prepare(bare, fidelity=fidelity, payload=scene.payload)
    return BipedEnvParams(robot=model, **numbers).validate()


def episode_params(params: BipedEnvParams, options: Mapping[str, Any]) -> BipedEnvParams:
    """The parameters with a start of their own, whatever is named, so that all options are one
    program; what they set is not drawn."""
    given = {name: pytrees.require_one(name, one, **DRAWS[name]) for name, one in options.items()}
    usual = {"phase": SUPPORT_START, "crank_rate": 0.0, "mean_rate": params.mean_rate}
    usual |= {} if params.mark is None else {"mark": params.mark}
    drawn = params.randomisation
    usual = {name: value for name, value in usual.items() if getattr(drawn, name) is None}
    starts = {name: (value, value) for name, value in (usual | given).items()}
    return params.replace(randomisation=replace(drawn, **starts))


def scene_from_plain(scene: Any) -> Any:
    """A scene: a name, or {"uniform": {...}} or {"patches": {...}} with arguments."""
    if not isinstance(scene, dict):
        return scene
    ((kind, numbers),) = scene.items()
    checks.require_choice("scene", kind, ("uniform", "patches"))
    return getattr(Scene, kind)(**numbers)
