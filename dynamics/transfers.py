"""Numbers of the host in calls that take them as such, under JAX's guard of transfers."""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import jax

if TYPE_CHECKING:
    from collections.abc import Callable

Given = ParamSpec("Given")
Result = TypeVar("Result")
GUARDS = ("jax_transfer_guard_host_to_device", "jax_transfer_guard_device_to_host")
FREE = (None, "allow")
"""Settings with which the transfer guard does nothing."""


def moves_numbers(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """`function`, of Python's numbers and NumPy's arrays, also where jax_transfer_guard forbids
    that they are moved to the device and back.

    For what prepares a robot or a track once, and for what is NumPy's by its interface. What runs
    in a user's own loop of JAX stays under the guard. Without a guard nothing is set.
    """

    @wraps(function)
    def call(*given: Given.args, **named: Given.kwargs) -> Result:
        if all(getattr(jax.config, name) in FREE for name in GUARDS):
            return function(*given, **named)
        with jax.transfer_guard("allow"):
            return function(*given, **named)

    return call
