"""Baseline controllers, to measure a policy against. See stickslip.agents.protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.agents.biped.control.action import action_of
from stickslip.agents.biped.control.computed_torque import ComputedTorque
from stickslip.agents.biped.control.optimal_gait import OptimalGait
from stickslip.agents.biped.control.speed_pi import CrankSpeedPI
from stickslip.agents.biped.control.stop_at_mark import StopAtMark
from stickslip.agents.biped.machine import BIPED_BASELINES
from stickslip.agents.protocol import Controller, Memoryless
from stickslip.dynamics.checks import require_choice, require_known, require_number
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams


BipedController: TypeAlias = "Controller[Any, BipedEnvState, BipedEnvParams]"


@register_pytree
@dataclass(frozen=True)
class ConstantTorque(Memoryless):
    """The same torque whatever happens (the chapter's Figs. 13 and 14).

    torque [N m]: below 0.84 from rest the default robot does not get over its first step; above 1.0
    it topples at once. Nothing takes out what the motor puts in, so that where the foot holds, each
    step is quicker than the one before.
    """

    torque: ArrayLike = 0.9

    def validate(self) -> ConstantTorque:
        """Return self, or raise ValueError naming the field."""
        require_number("torque", self.torque, low=-np.inf, accepted="a finite torque [N m]")
        return self

    def act(
        self,
        memory: None,
        obs: Float[Array, " obs"],
        env_state: BipedEnvState,
        env_params: BipedEnvParams,
    ) -> tuple[None, Float[Array, " 1"]]:
        """See Controller."""
        return memory, action_of(self.torque, env_params, env_state)


KINDS = (ConstantTorque, CrankSpeedPI, ComputedTorque, OptimalGait, StopAtMark)
Baseline: TypeAlias = ConstantTorque | CrankSpeedPI | ComputedTorque | OptimalGait | StopAtMark
CONTROLLERS: dict[str, type[Baseline]] = dict(zip(BIPED_BASELINES, KINDS, strict=True))
"""The baselines by the names that the command line knows."""


def controller_by_name(name: str, **settings: ArrayLike) -> BipedController:
    """A baseline with some settings changed. ValueError for an unknown name or setting."""
    require_choice("controller", name, CONTROLLERS)
    kind = CONTROLLERS[name]
    require_known(settings, kind.__dataclass_fields__, f"setting of {name}")
    return _built(kind, settings).validate()


def _built(kind: Callable[..., Baseline], settings: Mapping[str, ArrayLike]) -> Baseline:
    """With these settings alone: a default that costs something is not computed beside them."""
    return kind(**settings)


__all__ = [
    "CONTROLLERS",
    "ComputedTorque",
    "ConstantTorque",
    "Controller",
    "CrankSpeedPI",
    "OptimalGait",
    "StopAtMark",
    "controller_by_name",
]
