"""A training in a directory, alone or as one of two processes: DIRECTORY [HOST:PORT PROCESS].

Where the directory is new and there are two of them, the second one stops after two updates.
"""

import itertools
import sys
from pathlib import Path

from stickslip.agents import register
from stickslip.agents.training import processes
from stickslip.agents.training.train import train
from tests.agents.mass import MassConfig, MassMachine


def main(directory: str, coordinator: str | None = None, process: str = "0") -> None:
    """Print how it ended."""
    there = Path(directory).exists()
    processes.join(coordinator, *((int(process), 2) if coordinator else (None, None)))
    register(MassMachine())
    config = MassConfig.of(
        timesteps=512, num_envs=8, rollout_steps=16, batch_size=32, epochs=1, hidden=8
    )
    asked = itertools.count()
    stops = process == "1" and not there
    trained = train(
        None if there else config,
        directory,
        resume=there,
        bar=False,
        report=False,
        stop=lambda: stops and next(asked) >= 4,
    )
    print("finished" if trained.finished else "stopped", "at", trained.timesteps)


if __name__ == "__main__":
    main(*sys.argv[1:])
