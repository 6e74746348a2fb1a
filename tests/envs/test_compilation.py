"""Nothing is compiled twice: not by steps, resets, numbers or a second environment."""

from __future__ import annotations

import numpy as np
import pytest

from tests.envs.helpers import make, make_vec, task, warm_then_count
from tests.extras import SB3

OTHER_MODES = [pytest.param(mode, marks=pytest.mark.long) for mode in ("same_step", "disabled")]


@pytest.mark.parametrize("mode", ["single", "next_step", *OTHER_MODES])
def test_gymnasium_environments_compile_once(mode):
    def use(turn: int) -> None:
        env = make("random") if mode == "single" else make_vec(3, mode)
        env.reset(seed=turn)
        for _ in range(3):
            env.step(np.full(env.action_space.shape, 0.05 * turn, np.float32))
        env.reset()
        for i in range(3) if mode != "single" else ():
            env.reset(options={"reset_mask": np.arange(3) == i})

    assert warm_then_count(use) == 0


@SB3
def test_the_stable_baselines3_environment_compiles_once():
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    def use(turn: int) -> None:
        env = SB3VecEnv(*task("random"), 3, seed=turn)
        env.reset()
        for _ in range(3):
            env.step(np.full((3, 1), 0.05 * turn, np.float32))
        env.seed(turn)
        env.reset()

    assert warm_then_count(use) == 0
