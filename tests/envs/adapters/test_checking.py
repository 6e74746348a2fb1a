"""The comparison of vector with single environments passes what is right and finds faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorWrapper

from stickslip.envs import GymVectorEnv
from tests.envs.same_as_single import check_vector_env
from tests.envs.toy import one_toy, toys


class Faulty(VectorWrapper):
    """A vector environment whose results are tampered with from the 20th step on."""

    def __init__(self, env: GymVectorEnv, tamper: Callable[[list], None]):
        super().__init__(env)
        self.tamper, self.steps = tamper, 0

    def step(self, actions):
        results: list[Any] = list(self.env.step(actions))
        self.steps += 1
        if self.steps > 20:
            self.tamper(results)
        return tuple(results)


def nudge(place: int, amount: float) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        results[place] = results[place].copy()
        results[place][1] += amount

    return tamper


def change_info(name: str, change: Callable[[np.ndarray], Any]) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        if name in results[4]:
            column = results[4][name].copy()
            column[1] = change(column[1])
            results[4][name] = column

    return tamper


FAULTS: dict[str, Callable[[list], None]] = {
    "observation": nudge(0, 0.01),
    "reward": nudge(1, 0.01),
    "info's value": change_info("place", lambda value: value + 0.01),
    "info's mask": change_info("_place", lambda value: not value),
}


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_found(mode, fault):
    with pytest.raises(AssertionError, match=r"step 2\d"):
        check_vector_env(Faulty(toys(mode=mode), FAULTS[fault]), one_toy, steps=60)


def test_a_lost_final_observation_is_found():
    lost = change_info("_final_obs", lambda value: not value)
    with pytest.raises(AssertionError, match=r"step [2-5]\d"):
        check_vector_env(Faulty(toys(mode=AutoresetMode.SAME_STEP), lost), one_toy, steps=60)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_gymnasiums_own_vector_environment_passes(mode):
    sync = SyncVectorEnv([one_toy] * 3, autoreset_mode=mode)
    assert check_vector_env(sync, one_toy, steps=60) > 10
