"""Optimisers as users bring them, good and bad."""

import ctypes
import os
import sys
import time

import numpy as np


def searches(objective, seed):
    rng, (low, high) = np.random.default_rng(seed), objective.bounds
    while True:
        objective.batch_with_constraints(rng.uniform(low, high, (16, objective.n)))


def gives_up(objective):
    objective(objective.middle)


def raises(objective):
    gives_up(objective)
    raise RuntimeError("no luck")


def hides_the_end(objective):
    try:
        searches(objective, 0)
    except Exception as error:
        raise RuntimeError("what is this?") from error


def exits(objective):
    """Asks once, then ends as a script does."""
    objective(objective.middle)
    sys.exit(3)


def dies(objective):
    gives_up(objective)
    os._exit(3)


def hangs_in_c(objective):
    """With the interpreter's lock, so that nothing in its process can stop it, from the 13th on."""
    from tests.agents.optimisers.table import NAME, suite

    objective(suite()[NAME].known.x)
    for share in np.linspace(0.3, 0.6, 12):
        objective(objective.from_unit(np.full(objective.n, share)))
    ctypes.PyDLL(None).sleep(1000)


def gives_nan(objective):
    while True:
        objective(np.full(objective.n, np.nan))


def goes_outside(objective):
    objective(objective.bounds[1] + 1)


def is_slow(objective, seed):
    time.sleep(0.3)
    gives_up(objective)
