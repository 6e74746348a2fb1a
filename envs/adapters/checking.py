"""Check that a vector environment equals as many single ones, step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from gymnasium.vector import AutoresetMode

if TYPE_CHECKING:
    from collections.abc import Callable

    import gymnasium
    from gymnasium.vector import VectorEnv
    from numpy.typing import ArrayLike


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
    """Step a vector environment beside single ones made by `make_single`, and compare everything.

    Both get the seeds seed, seed + 1, ... and the same random actions (of the action space, times
    `scale`). Compared after every step: shapes, types, observations, rewards, both flags, infos and
    their masks, final observations and infos, resets in every AutoresetMode. Returns how many
    episodes ended, so that a caller can see that resets were exercised. Raises ValueError at the
    first difference, naming step, environment and entry.
    """
    singles = [make_single() for _ in range(vector_env.num_envs)]
    try:
        return _Comparison(vector_env, singles, rtol, atol).run(steps, seed, scale)
    finally:
        for env in singles:
            env.close()


Step: TypeAlias = int | str
"""Its number, or what came instead."""


class _Comparison:
    def __init__(self, vector_env: VectorEnv, singles: list, rtol: float, atol: float):
        self.vector_env, self.singles = vector_env, singles
        self.rtol, self.atol = rtol, atol
        self.mode = vector_env.metadata.get("autoreset_mode")
        if not isinstance(self.mode, AutoresetMode):
            raise ValueError(f"metadata['autoreset_mode'] = {self.mode!r}; accepted: AutoresetMode")
        self.over = [False] * len(singles)

    def run(self, steps: int, seed: int, scale: float) -> int:
        """All steps; the number of episodes that ended."""
        random = np.random.default_rng(seed)
        obs, _ = self.vector_env.reset(seed=seed)
        self._space("reset", obs)
        for i, env in enumerate(self.singles):
            self._same("reset", i, "observation", obs[i], env.reset(seed=seed + i)[0])
        ended = 0
        for step in range(steps):
            if self.mode is AutoresetMode.DISABLED and any(self.over):
                self._reset_finished(step)
            low, high = self.vector_env.action_space.low, self.vector_env.action_space.high  # type: ignore[attr-defined]
            actions = (scale * random.uniform(low, high)).astype(low.dtype)
            given = self.vector_env.step(actions)
            self._space(step, given[0])
            self._columns(step, given)
            for i in range(len(self.singles)):
                ended += self._step_one(step, i, actions[i], given)
        return ended

    def _step_one(self, step: int, i: int, action: np.ndarray, given: tuple) -> bool:
        """One single environment against its row; whether its episode ended."""
        obs, reward, terminated, truncated, infos = given
        env = self.singles[i]
        if self.mode is AutoresetMode.NEXT_STEP and self.over[i]:
            expected = (env.reset()[0], 0.0, False, False, {})
        else:
            expected = env.step(action)
        self.over[i] = ends = expected[2] or expected[3]
        info = expected[4]
        first_obs = expected[0]
        if ends and self.mode is AutoresetMode.SAME_STEP:
            self._masked(step, i, infos, {"final_obs": expected[0]})
            self._masked(step, i, infos.get("final_info", {}), info)
            if not _mask(step, infos, "final_info")[i]:
                raise ValueError(f"step {step}, environment {i}: info 'final_info' is missing")
            first_obs, info = env.reset()
            self.over[i] = False
        self._same(step, i, "observation", obs[i], first_obs)
        self._same(step, i, "reward", reward[i], expected[1])
        self._same(step, i, "terminated", terminated[i], expected[2])
        self._same(step, i, "truncated", truncated[i], expected[3])
        self._masked(step, i, infos, info)
        kept = ends and self.mode is AutoresetMode.SAME_STEP
        expected_names = {*info, "final_obs", "final_info"} if kept else set(info)
        for name in infos:
            named = name in expected_names or name.startswith("_")
            if not named and _mask(step, infos, name)[i]:
                raise ValueError(f"step {step}, environment {i}: info {name!r} is not expected")
        return ends

    def _reset_finished(self, step: int) -> None:
        mask = np.asarray(self.over)
        obs, _ = self.vector_env.reset(options={"reset_mask": mask})
        for i in map(int, np.flatnonzero(mask)):
            self._same(f"reset before {step}", i, "observation", obs[i], self.singles[i].reset()[0])
        self.over = [False] * len(self.singles)

    def _masked(self, step: Step, i: int, infos: dict, expected: dict) -> None:
        for name, value in expected.items():
            if name not in infos or not _mask(step, infos, name)[i]:
                raise ValueError(f"step {step}, environment {i}: info {name!r} is missing")
            self._same(step, i, f"info {name!r}", infos[name][i], value)

    def _same(self, step: Step, i: int, name: str, given: ArrayLike, expected: ArrayLike) -> None:
        if not np.allclose(given, expected, rtol=self.rtol, atol=self.atol, equal_nan=True):
            raise ValueError(
                f"step {step}, environment {i}: {name} is {given} in the vector environment and "
                f"{expected} in a single one"
            )

    def _columns(self, step: int, given: tuple) -> None:
        """Shape and type of the rewards and of both flags."""
        count = len(self.singles)
        kinds = {"reward": np.floating, "terminated": np.bool_, "truncated": np.bool_}
        for (name, kind), column in zip(kinds.items(), given[1:4], strict=True):
            if np.shape(column) != (count,) or not np.issubdtype(np.asarray(column).dtype, kind):
                raise ValueError(
                    f"step {step}: {name} has shape {np.shape(column)} and type "
                    f"{np.asarray(column).dtype}; accepted: {kind.__name__} [{count}]"
                )

    def _space(self, step: Step, obs: np.ndarray) -> None:
        if not self.vector_env.observation_space.contains(obs):
            raise ValueError(f"step {step}: observation {obs!r} is outside the space")


def _mask(step: Step, infos: dict, name: str) -> np.ndarray:
    """Mask of an entry of infos."""
    if f"_{name}" not in infos:
        raise ValueError(f"step {step}: info {name!r} has no mask; accepted: one as '_{name}'")
    return infos[f"_{name}"]
