"""check_vector_env passes what is right and finds every planted fault."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorWrapper

from stickslip.envs import GymEnv, GymVectorEnv, check_vector_env
from tests.envs.toy import PARAMS, Toy, one_toy, toys

MODES = list(AutoresetMode)


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


def flip(place: int) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        results[place] = results[place].copy()
        results[place][1] ^= True

    return tamper


def change_info(name: str, change: Callable[[np.ndarray], Any]) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        if name in results[4]:
            column = results[4][name].copy()
            column[1] = change(column[1])
            results[4][name] = column

    return tamper


def drop_info(*names: str) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        for name in names:
            results[4].pop(name, None)

    return tamper


def retype(place: int, dtype: Any) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        results[place] = results[place].astype(dtype)

    return tamper


def reshape(place: int) -> Callable[[list], None]:
    def tamper(results: list) -> None:
        results[place] = results[place][:, None]

    return tamper


def add_info(results: list) -> None:
    results[4] |= {"extra": np.ones(3), "_extra": np.asarray([False, True, False])}


def swap(results: list) -> None:
    results[0] = results[0][[1, 0, 2]]


FAULTS: dict[str, Callable[[list], None]] = {
    "observation": nudge(0, 0.01),
    "observations of two swapped": swap,
    "observation's type": retype(0, np.float64),
    "reward": nudge(1, 0.01),
    "reward's shape": reshape(1),
    "reward not a number": nudge(1, np.nan),
    "terminated": flip(2),
    "truncated": flip(3),
    "flag's type": retype(2, np.int64),
    "flag's shape": reshape(3),
    "info's value": change_info("place", lambda value: value + 0.01),
    "info's integer": change_info("episode_length", lambda value: value + 1),
    "info's flag": change_info("right", lambda value: not value),
    "info's mask": change_info("_place", lambda value: not value),
    "info missing": drop_info("place", "_place"),
    "mask missing": drop_info("_place"),
    "info too much": add_info,
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_found(mode, fault):
    with pytest.raises(ValueError, match=r"step 2\d"):
        check_vector_env(Faulty(toys(mode=mode), FAULTS[fault]), one_toy, steps=60)


SAME_STEP_FAULTS: dict[str, Callable[[list], None]] = {
    "final observation": change_info(
        "final_obs", lambda value: None if value is None else value + 0.01
    ),
    "final observation's mask": change_info("_final_obs", lambda value: not value),
    "final observation missing": drop_info("final_obs", "_final_obs"),
    "final information missing": drop_info("final_info", "_final_info"),
    "final information's mask": change_info("_final_info", lambda value: not value),
}


@pytest.mark.parametrize("fault", SAME_STEP_FAULTS)
def test_a_fault_in_what_same_step_keeps_is_found(fault):
    faulty = Faulty(toys(mode=AutoresetMode.SAME_STEP), SAME_STEP_FAULTS[fault])
    with pytest.raises(ValueError, match=r"step [2-5]\d"):
        check_vector_env(faulty, one_toy, steps=60)


class WrongMode(VectorWrapper):
    """Says that it resets in another way than it does."""

    def __init__(self, env: GymVectorEnv, said: Any):
        super().__init__(env)
        self.metadata = dict(env.metadata, autoreset_mode=said)


@pytest.mark.parametrize(
    ("mode", "said"),
    [
        (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP),
        (AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP),
        (AutoresetMode.SAME_STEP, AutoresetMode.DISABLED),
    ],
)
def test_another_mode_than_the_one_told_is_found(mode, said):
    with pytest.raises(ValueError, match="step"):
        check_vector_env(WrongMode(toys(mode=mode), said), one_toy, steps=60)


@pytest.mark.parametrize("said", [None, "next_step", "NextStep", True])
def test_a_mode_that_is_not_the_enum_is_found(said):
    with pytest.raises(ValueError, match=r"metadata\['autoreset_mode'\] = .*accepted"):
        check_vector_env(WrongMode(toys(), said), one_toy)


class Freezing(VectorWrapper):
    """Does what FunctionalJaxVectorEnv does: nobody moves while one is reset."""

    over = np.zeros(3, bool)

    def step(self, actions):
        before = self.env.unwrapped._envs._carry  # type: ignore[attr-defined]
        results = self.env.step(actions)
        if self.over.any() and not self.over.all():
            self.env.unwrapped._envs._carry = before  # type: ignore[attr-defined]
        self.over = results[2] | results[3]
        return results


def test_environments_frozen_by_anothers_reset_are_found():
    with pytest.raises(ValueError, match="observation"):
        check_vector_env(Freezing(toys()), one_toy, steps=60)


def test_a_reset_to_something_else_is_found():
    class Other(VectorWrapper):
        def reset(self, *, seed=None, options=None):
            return self.env.reset(seed=None if seed is None else seed + 1, options=options)

    with pytest.raises(ValueError, match="reset, environment 0: observation"):
        check_vector_env(Other(toys()), one_toy)


@pytest.mark.parametrize("mode", MODES)
def test_gymnasiums_own_vector_environment_passes(mode):
    sync = SyncVectorEnv([one_toy] * 3, autoreset_mode=mode)
    assert check_vector_env(sync, one_toy, steps=60) > 10


def test_the_number_of_ended_episodes_is_told():
    gentle = {"steps": 2 * PARAMS.limit, "scale": 0.0}
    assert check_vector_env(toys(mode=AutoresetMode.SAME_STEP), one_toy, **gentle) == 6
    assert check_vector_env(toys(mode=AutoresetMode.NEXT_STEP), one_toy, **gentle) == 3


def test_the_single_environments_are_closed_even_when_a_fault_is_found():
    closed = []

    class Closing(GymEnv):
        def close(self):
            closed.append(self)

    def single():
        return Closing(Toy("disabled"), PARAMS)

    check_vector_env(toys(), single, steps=3)
    with pytest.raises(ValueError, match="observation"):
        check_vector_env(Faulty(toys(), nudge(0, 1.0)), single, steps=60)
    assert len(closed) == 6
