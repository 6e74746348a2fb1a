"""Which precision a test of both asks for in the quick run."""

import pytest

mostly_single = pytest.mark.parametrize(
    "dtype", ["float32", pytest.param("float64", marks=pytest.mark.long)], indirect=True
)
"""In single precision; in double, which is a program of its own, in the long run."""
