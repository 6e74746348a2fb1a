"""Environments in forked processes: none of JAX's threads is there, so they would wait for ever."""

from __future__ import annotations

import os

_process: int | None = None
"""The process that the first environment by name was made in; a fork inherits it."""


def require_unforked() -> None:
    """RuntimeError where an environment was made before this process was forked.

    What Gymnasium's AsyncVectorEnv does on Linux: it makes one environment, then forks the others.
    """
    global _process
    if _process is None:
        _process = os.getpid()
    if _process != os.getpid():
        raise RuntimeError(
            "an environment in a process forked after another one was made, where JAX waits for "
            "ever; accepted: processes that are spawned (AsyncVectorEnv(..., context='spawn'), "
            "make_vec(..., vectorization_mode='async', vector_kwargs={'context': 'spawn'})), or "
            "make_vec without a vectorization_mode: all of them in one compiled call"
        )
