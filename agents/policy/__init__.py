"""Policies: the network, its file and where it comes from."""

from stickslip.agents.policy.describe import describe_environment
from stickslip.agents.policy.file import load_policy, read_metadata, save_policy
from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.agents.policy.onnx import export_onnx
from stickslip.agents.policy.plain import PlainPolicy
from stickslip.agents.policy.sb3 import from_sb3

__all__ = [
    "MLPPolicy",
    "PlainPolicy",
    "describe_environment",
    "export_onnx",
    "from_sb3",
    "load_policy",
    "read_metadata",
    "save_policy",
]
