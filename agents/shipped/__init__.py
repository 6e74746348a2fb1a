"""Trained policies that the package holds as data, by name."""

from stickslip.agents.shipped.names import policy_name, shipped_names, shipped_path

__all__ = ["policy_name", "shipped_names", "shipped_path"]
