"""Every test of the optimisation runs under strict promotion, and with the user's switch off."""

from tests.dynamics.conftest import _strict_promotion  # noqa: F401  (pytest finds it here)
