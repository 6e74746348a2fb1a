"""Policies: the network, its file and where it comes from."""

from stickslip.agents.policy.describe import describe_environment
from stickslip.agents.policy.file import load_policy, read_metadata, save_policy
from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.agents.policy.sb3 import from_sb3

__all__ = [
    "MLPPolicy",
    "describe_environment",
    "from_sb3",
    "load_policy",
    "read_metadata",
    "save_policy",
]
