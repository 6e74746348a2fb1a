"""Baseline controllers, to measure a policy against. See stickslip.agents.protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from stickslip.agents.biped.output_feedback import OutputFeedback
from stickslip.agents.biped.prediction import ComputedTorque, OptimalGait, action_of
from stickslip.agents.biped.stopping import CrankSpeedPI, StopAtMark
from stickslip.agents.protocol import Controller, Memoryless
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.pytrees import pytree_dataclass

if TYPE_CHECKING:
    from jax.typing import ArrayLike

    from stickslip.agents.protocol import Action, Obs
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState


@pytree_dataclass
class ConstantTorque(Memoryless):
    """The same torque whatever happens (the chapter's Figs. 13 and 14).

    torque [N m]: below 0.84 from rest the default robot does not get over its first step; above 1.0
    it topples at once. Nothing takes out what the motor puts in, so that where the foot holds, each
    step is quicker than the one before.
    """

    torque: ArrayLike = 0.9
    RULES: ClassVar = {"torque": {"accepted": "a finite torque [N m]"}}

    def act(
        self, memory: None, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[None, Action]:
        """See Controller."""
        return memory, action_of(self.torque, env_params, env_state)


CONTROLLERS = {
    "constant-torque": ConstantTorque,
    "crank-speed-pi": CrankSpeedPI,
    "computed-torque": ComputedTorque,
    "optimal-gait": OptimalGait,
    "stop-at-mark": StopAtMark,
    "output-feedback": OutputFeedback,
}
"""The baselines by the names that the command line knows, BIPED_BASELINES."""


def baseline(name: str, env: BipedEnv) -> Controller[Any, BipedEnvState, BipedEnvParams]:
    """See Machine; a baseline suits every environment."""
    require_choice("controller", name, CONTROLLERS)
    return CONTROLLERS[name]()
