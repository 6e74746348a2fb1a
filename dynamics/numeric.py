"""The type of a numeric field."""

from typing import Any

Numeric = Any
"""A Python number, a NumPy or a JAX array: given as any of them and read as an array, which no
narrower type says."""
