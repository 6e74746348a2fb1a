"""Optimisers as users bring them, good and bad."""

import os
import sys
import time

import numpy as np


def searches(objective, seed):
    rng, (low, high) = np.random.default_rng(seed), objective.bounds
    while True:
        objective.batch_with_constraints(rng.uniform(low, high, (16, objective.n)))


def gives_up(objective, seed):
    objective(objective.middle)


def raises(objective, seed):
    gives_up(objective, seed)
    raise RuntimeError("no luck")


def hides_the_end(objective, seed):
    try:
        searches(objective, 0)
    except Exception as error:
        raise RuntimeError("what is this?") from error


def exits(objective, seed):
    """Asks once, then ends as a script does."""
    objective(objective.middle)
    sys.exit(3)


def dies(objective, seed):
    gives_up(objective, seed)
    os._exit(3)


def sleeps(objective, seed):
    time.sleep(1000)


def forks(objective, seed):
    """Both processes go on."""
    os.fork()
    searches(objective, seed)


def leaves_a_process(objective, seed):
    """A process that stays, with the other's lock on a file."""
    import fcntl

    with open("held", "w") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        if os.fork() == 0:
            time.sleep(1000)


def gives_nan(objective, seed):
    while True:
        objective(np.full(objective.n, np.nan))


def goes_outside(objective, seed):
    objective(objective.bounds[1] + 1)


def is_slow(objective, seed):
    time.sleep(0.6)
    gives_up(objective, seed)
