"""A process that makes runs for another one, which may kill it: `python -m` this module.

Tasks come in as pickles after their length, and what is to tell goes out likewise. What optimisers
print goes to standard error. It ends when its input does, or, on Linux, when its parent does, also
from within C code.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
import sys
from contextlib import suppress
from queue import SimpleQueue
from threading import Thread
from typing import IO

from stickslip.records.signals import ENDING

LENGTH = struct.Struct("<Q")
DIES_WITH_PARENT = 1
"""Linux's PR_SET_PDEATHSIG."""


def send(to: IO[bytes], content: bytes) -> None:
    """Write it after its length."""
    to.write(LENGTH.pack(len(content)) + content)
    to.flush()


def receive(at: IO[bytes]) -> bytes | None:
    """What was sent; None at the end."""
    head = at.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (size,) = LENGTH.unpack(head)
    content = at.read(size)
    return content if len(content) == size else None


def main() -> None:
    """Run what is asked for until nothing more is."""
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(DIES_WITH_PARENT, signal.SIGKILL)
    for one in ENDING:
        signal.signal(one, signal.SIG_IGN)  # the parent decides
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    asked: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_listen, args=(asked,), daemon=True).start()
    from stickslip.agents.optimisers.task import make_ready, run_task, try_out

    while True:
        task = pickle.loads(asked.get())
        make_ready(task)
        send(out, pickle.dumps(("made", None)))
        try_out(task)
        send(out, pickle.dumps(("tried", None)))
        ending = run_task(task, lambda event: send(out, pickle.dumps(("event", event))))
        send(out, pickle.dumps(("end", ending)))


def _listen(asked: SimpleQueue[bytes]) -> None:
    """Take what is asked; where there is no more, nobody wants the rest."""
    while (task := receive(sys.stdin.buffer)) is not None:
        asked.put(task)
    os._exit(0)


if __name__ == "__main__":
    main()
