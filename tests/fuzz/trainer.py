"""A process that has imported all that training needs, and forks a child for each training.

Lines on stdin: {"path": directory, "how": {"resume": true, ...}, "kill_after": seconds or null,
"kill_from": checkpoints}. The seconds count from when there are so many checkpoints more than there
were. For each of them a line on stdout with the exit status of the child, ended or killed.
"""

import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path

from stickslip.agents.biped import task  # noqa: F401
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.training.run import train
from stickslip.agents.training.sb3 import SB3Trainer  # noqa: F401

CONFIG = TrainConfig.of(
    trainer="sb3",
    timesteps=512,
    checkpoint_interval=64,
    num_envs=4,
    rollout_steps=16,
    batch_size=64,
    epochs=2,
    hidden=8,
    evaluation_episodes=1,
    episode_time=0.4,
    seed=3,
)
REFUSED = 3


def main() -> None:
    """Serve until stdin ends."""
    for line in sys.stdin:
        asked = json.loads(line)
        child = os.fork()
        if child == 0:
            status = 1
            try:
                status = run(asked["path"], asked["how"])
            finally:
                os._exit(status)
        if asked["kill_after"] is not None:
            wait_for(child, Path(asked["path"], "checkpoints"), asked["kill_from"])
            time.sleep(asked["kill_after"])
            os.kill(child, signal.SIGKILL)  # a child that has ended is there until it is waited for
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def wait_for(child: int, folder: Path, more: int) -> None:
    """Until there are so many checkpoints more, or the child has ended."""
    enough = count_of(folder) + more
    while more and count_of(folder) < enough:
        if os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
            return
        time.sleep(0.002)


def count_of(folder: Path) -> int:
    return len(list(folder.iterdir())) if folder.is_dir() else 0


def run(path: str, how: dict) -> int:
    """Train; what goes wrong is added to a file beside the directory. A training stands still while
    there is a file `<path>.held`."""
    status, words, held = 1, "", Path(path + ".held")

    def wait() -> bool:
        while held.exists():
            time.sleep(0.01)
        return False

    try:
        return 0 if train(CONFIG, path, bar=False, stop=wait, **how).finished else 2
    except ValueError as error:
        status, words = REFUSED, str(error)
    except Exception:  # noqa: BLE001, whatever it is, the test shows it
        words = traceback.format_exc()
    with Path(path + ".said").open("a") as file:
        file.write(words + "\n")
    return status


if __name__ == "__main__":
    main()
