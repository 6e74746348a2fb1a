"""Environments: pure functional cores and their Gymnasium and Stable-Baselines3 adapters."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.adapters.gym import GymEnv as GymEnv
    from stickslip.envs.adapters.gym import GymVectorEnv as GymVectorEnv
    from stickslip.envs.adapters.gymnax import GymnaxEnv as GymnaxEnv
    from stickslip.envs.adapters.sb3 import SB3VecEnv as SB3VecEnv
    from stickslip.envs.biped.env import BipedEnv as BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams as BipedEnvParams
    from stickslip.envs.biped.params import Randomisation as Randomisation
    from stickslip.envs.biped.state import BipedEnvState as BipedEnvState
    from stickslip.envs.collecting import Collected as Collected
    from stickslip.envs.collecting import collect as collect
    from stickslip.envs.functional import FunctionalEnv as FunctionalEnv
    from stickslip.envs.history import FrameStack as FrameStack
    from stickslip.envs.tasks.definition import TASKS as TASKS
    from stickslip.envs.tasks.definition import TaskDefinition as TaskDefinition
    from stickslip.envs.tasks.definition import task_by_name as task_by_name
    from stickslip.envs.tasks.known import known_of as known_of
    from stickslip.envs.ugv.env import UGVEnv as UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams as UGVEnvParams
    from stickslip.envs.ugv.randomisation import RandomTrack as RandomTrack
    from stickslip.envs.ugv.randomisation import UGVRandomisation as UGVRandomisation
    from stickslip.envs.ugv.state import UGVEnvState as UGVEnvState
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
    __all__.remove("SB3VecEnv")  # `import *` needs no Stable-Baselines3
