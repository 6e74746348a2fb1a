"""A vector environment beside as many single ones, step by step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv


def check_vector_env(
    vector_env: VectorEnv,
    make_single: Callable[[], gymnasium.Env],
    *,
    steps: int = 200,
    seed: int = 0,
    scale: float = 1.0,
    rtol: float = 1e-4,
    atol: float = 1e-4,
) -> int:
    """Compare a vector environment with single ones under the same seeds and random actions.

    Both get the seeds seed, seed + 1, ... and actions of the action space times `scale`. Compared
    after every step: observations, rewards, both flags, infos with their masks, and the resets of
    every AutoresetMode. Returns the number of episodes that ended. AssertionError at the first
    difference.
    """
    singles = [make_single() for _ in range(vector_env.num_envs)]
    return _Comparison(vector_env, singles, rtol, atol).run(steps, seed, scale)


class _Comparison:
    def __init__(self, vector_env: VectorEnv, singles: list, rtol: float, atol: float):
        self.vector_env, self.singles = vector_env, singles
        self.rtol, self.atol = rtol, atol
        self.mode = vector_env.metadata["autoreset_mode"]
        assert isinstance(self.mode, AutoresetMode)
        self.over = [False] * len(singles)

    def run(self, steps: int, seed: int, scale: float) -> int:
        random, ended = np.random.default_rng(seed), 0
        obs, _ = self.vector_env.reset(seed=seed)
        for i, env in enumerate(self.singles):
            self._same("reset", i, "observation", obs[i], env.reset(seed=seed + i)[0])
        for step in range(steps):
            if self.mode is AutoresetMode.DISABLED and any(self.over):
                self._reset_finished(step)
            low, high = self.vector_env.action_space.low, self.vector_env.action_space.high  # type: ignore[attr-defined]
            actions = (scale * random.uniform(low, high)).astype(low.dtype)
            given = self.vector_env.step(actions)
            assert self.vector_env.observation_space.contains(given[0]), f"step {step}"
            self._columns(step, given)
            for i in range(len(self.singles)):
                ended += self._step_one(step, i, actions[i], given)
        return ended

    def _step_one(self, step: int, i: int, action: np.ndarray, given: tuple) -> bool:
        """One single environment against its row; True if its episode ended."""
        obs, *columns, infos = given
        env = self.singles[i]
        if self.mode is AutoresetMode.NEXT_STEP and self.over[i]:
            expected = (env.reset()[0], 0.0, False, False, {})
        else:
            expected = env.step(action)
        first_obs, _, terminated, truncated, info = expected
        self.over[i] = ends = terminated or truncated
        names = set(info)
        if ends and self.mode is AutoresetMode.SAME_STEP:
            self._masked(step, i, infos, {"final_obs": first_obs})
            self._masked(step, i, infos["final_info"], info)
            assert infos["_final_info"][i], f"step {step}, environment {i}: no final_info"
            first_obs, info = env.reset()
            names |= {"final_obs", "final_info"}
            self.over[i] = False
        self._same(step, i, "observation", obs[i], first_obs)
        for name, column, value in zip(
            ("reward", "terminated", "truncated"), columns, expected[1:4], strict=True
        ):
            self._same(step, i, name, column[i], value)
        self._masked(step, i, infos, info)
        for name in infos:
            known = name in names or name.startswith("_")
            assert known or not infos[f"_{name}"][i], f"step {step}, environment {i}: info {name}"
        return ends

    def _reset_finished(self, step: int) -> None:
        mask = np.asarray(self.over)
        obs, _ = self.vector_env.reset(options={"reset_mask": mask})
        for i in map(int, np.flatnonzero(mask)):
            self._same(f"{step}, reset", i, "observation", obs[i], self.singles[i].reset()[0])
        self.over = [False] * len(self.singles)

    def _masked(self, step: int, i: int, infos: dict, expected: dict) -> None:
        for name, value in expected.items():
            assert name in infos, f"step {step}, environment {i}: info {name} is missing"
            assert infos[f"_{name}"][i], f"step {step}, environment {i}: info {name} is masked"
            self._same(step, i, f"info {name}", infos[name][i], value)

    def _same(self, step: int | str, i: int, name: str, given: Any, expected: Any) -> None:
        close = np.allclose(given, expected, rtol=self.rtol, atol=self.atol, equal_nan=True)
        message = f"step {step}, environment {i}: {name} is {given}, of a single one {expected}"
        assert close, message

    def _columns(self, step: int, given: tuple) -> None:
        """Shape and type of the rewards and of both flags."""
        for kind, column in zip((np.floating, np.bool_, np.bool_), given[1:4], strict=True):
            assert np.shape(column) == (len(self.singles),), f"step {step}"
            assert np.issubdtype(np.asarray(column).dtype, kind), f"step {step}"
