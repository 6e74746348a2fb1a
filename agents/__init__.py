"""Baseline controllers, training, policy files and batch evaluation."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.biped.controllers import (
        ComputedTorque,
        ConstantTorque,
        CrankSpeedPI,
    )
    from stickslip.agents.biped.evaluate import evaluate
    from stickslip.agents.biped.task import describe_environment
    from stickslip.agents.evaluation.rollout import rollout
    from stickslip.agents.pictures.film import film
    from stickslip.agents.policy.file import load_policy, save_policy
    from stickslip.agents.policy.mlp import MLPPolicy
    from stickslip.agents.policy.sb3 import from_sb3
    from stickslip.agents.training.run import train
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "biped.controllers": ("ComputedTorque", "ConstantTorque", "CrankSpeedPI"),
            "biped.evaluate": ("evaluate",),
            "biped.task": ("describe_environment",),
            "evaluation.rollout": ("rollout",),
            "pictures.film": ("film",),
            "policy.file": ("load_policy", "save_policy"),
            "policy.mlp": ("MLPPolicy",),
            "policy.sb3": ("from_sb3",),
            "training.run": ("train",),
        },
    )

__all__ = [
    "ComputedTorque",
    "ConstantTorque",
    "CrankSpeedPI",
    "MLPPolicy",
    "describe_environment",
    "evaluate",
    "film",
    "from_sb3",
    "load_policy",
    "rollout",
    "save_policy",
    "train",
]
