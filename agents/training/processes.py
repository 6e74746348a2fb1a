"""Several processes that train together: the first one writes the run, the others learn with it.

Each takes its part of the environments; what learning goes on from is the same in all of them. The
first one, the lead, tells the others what to train and from where: they need neither its directory
nor its flags.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.registry import machine_of_config, read_configuration
from stickslip.agents.training.checkpoint import POLICY
from stickslip.agents.training.state_file import pack, unpack
from stickslip.agents.training.trained import Trained
from stickslip.agents.training.trainer import Update, trainer_of
from stickslip.dynamics.checks import require_integer

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from stickslip.agents.training.configuration import Configuration
    from stickslip.agents.training.directory import Run
    from stickslip.agents.training.state_file import ModelState

AUTO = "auto"
LARGEST = 2**34
"""Bytes that the lead may tell."""


class Told(NamedTuple):
    """What the lead says; error: why it could not begin, else ""."""

    error: str
    config: str = ""
    timesteps: int = 0
    model: ModelState | None = None


def join(coordinator: str | None, process: int | None, processes: int | None) -> None:
    """Begin JAX's runtime over several processes, before anything else of JAX is used.

    Where nothing is asked for, nothing begins.

    coordinator: HOST:PORT of the first process, or "auto" where JAX finds all by itself (Slurm,
    Open MPI, Kubernetes, TPUs, or its own environment variables). ValueError for numbers that do
    not go together.
    """
    import jax

    if coordinator is None:
        if process is not None or processes is not None:
            raise ValueError("process, processes without coordinator; accepted: all three")
        return
    if coordinator == AUTO:
        if process is not None or processes is not None:
            raise ValueError(
                "process, processes with coordinator = 'auto'; accepted: HOST:PORT with both, or "
                "'auto' alone"
            )
        jax.distributed.initialize()
        return
    host, _, port = coordinator.rpartition(":")
    if not host or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise ValueError(
            f"coordinator = {coordinator!r} is not accepted; accepted: HOST:PORT of the first "
            "process, or 'auto'"
        )
    if process is None or processes is None:
        raise ValueError(
            "coordinator without process or processes; accepted: all three, --process 0 "
            "--processes 2 for the first of two"
        )
    processes = require_integer("processes", processes, high=4096)
    process = require_integer("process", process, low=0, high=processes - 1)
    jax.distributed.initialize(coordinator, processes, process)


def count() -> int:
    """Processes that train together."""
    import jax

    return jax.process_count()


def is_lead() -> bool:
    """Whether this is the first of them."""
    import jax

    return jax.process_index() == 0


def leading(begin: Callable[[], tuple[Run, ModelState | None]]) -> tuple[Run, ModelState | None]:
    """begin(): the run and what it goes on from, which the lead tells the others, if there are any;
    or that it failed."""
    if count() == 1:
        return begin()
    try:
        run, model = begin()
    except BaseException as error:
        _tell(Told(f"{error}" or type(error).__name__))
        raise
    at = 0 if run.state is None else run.state.timesteps
    _tell(Told("", run.config.to_json(), at, model))
    return run, model


def require_together(config: Configuration) -> None:
    """ValueError for what several processes cannot train."""
    trainer = getattr(config, "trainer", "sb3")
    if count() > 1 and trainer != "jax":
        raise ValueError(
            f"trainer = {trainer!r} with {count()} processes; accepted: one process, or 'jax'"
        )


def _tell(message: Told) -> None:
    head = json.dumps(message._replace(model=None)).encode()
    for raw in (head, pack(message.model or {})):
        _from_lead(np.asarray(len(raw)))
        _from_lead(np.frombuffer(raw, np.uint8))


def _listen() -> Told:
    """What the lead tells. ValueError in its words where it could not begin."""
    head, model = (
        _from_lead(np.zeros(int(_from_lead(np.asarray(0))), np.uint8)).tobytes() for _ in range(2)
    )
    told = Told(*json.loads(head))
    if told.error:
        raise ValueError(f"the first process: {told.error}")
    return told._replace(model=unpack(model, LARGEST) or None)


def follow(
    directory: Path, stop: Callable[[], bool], devices: int | None
) -> Trained[Configuration]:
    """Train with the lead, whatever it trains, and write nothing. directory: the lead's."""
    told = _listen()
    config = read_configuration(told.config)
    task = machine_of_config(config).training_task(config)
    kind = trainer_of(config)
    trainer = kind(config, task.env, task.training, _nothing, stop, devices)
    try:
        if told.model is not None:
            trainer.put_state(told.model)
        trainer.timesteps = told.timesteps
        total, interval = config.timesteps, config.checkpoint_interval
        while (at := trainer.timesteps) < total and not trainer.stopped:
            trainer.begin_stretch(at)
            trainer.advance(min((at // interval + 1) * interval, total))
            if trainer.timesteps > at:
                trainer.is_finite()
                trainer.take_state()
        done = trainer.timesteps >= total
        return Trained(directory, directory / POLICY, config, trainer.timesteps, math.nan, done)
    finally:
        trainer.close()


def _nothing(update: Update) -> None:
    del update


def _from_lead(array: np.ndarray) -> np.ndarray:
    from jax.experimental.multihost_utils import broadcast_one_to_all

    return np.asarray(broadcast_one_to_all(array))
