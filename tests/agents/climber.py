"""A trainer that is not Stable-Baselines3: random changes of a policy, the best of which stay."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from stickslip.agents import MLPPolicy
from stickslip.agents.evaluation.rollout import play
from stickslip.agents.evaluation.table import keep_of
from stickslip.agents.training.trainer import Trainer, Update

STEPS = 64
"""Counted for each change that is tried."""


class Climber(Trainer):
    """Hill climbing on the weights of a linear policy."""

    losses = ("spread",)

    def build(self) -> None:
        self._weights, self._best = np.zeros((2, 1), np.float32), -np.inf
        self._random = np.random.default_rng(0)

    def begin_stretch(self, timesteps: int) -> None:
        self.timesteps = timesteps
        self._random = np.random.default_rng([self.config.seed, timesteps])

    def advance(self, goal: int) -> None:
        while self.timesteps < goal and not self.stopped:
            change = self._random.normal(0, 0.5, self._weights.shape)
            tried = (self._weights + change).astype(np.float32)
            reward = play(self.env, _policy(tried), self.params, (0, 1), keep_of).reward
            if reward.mean() > self._best:
                self._weights, self._best = tried, float(reward.mean())
            self.timesteps += STEPS
            length = np.full(len(reward), 30)
            ended = {"episode_return": reward, "episode_length": length}
            self.report(
                Update(self.timesteps, np.nan, 0.5, ended, {"spread": float(np.ptp(reward))})
            )
            self.stopped = self.stop()

    def take_state(self) -> dict[str, Any]:
        return {"weights": self._weights, "best": self._best}

    def put_state(self, state: dict[str, Any]) -> None:
        if np.shape(state["weights"]) != self._weights.shape:
            raise ValueError(f"weights of shape {np.shape(state['weights'])}")
        self._weights, self._best = state["weights"], state["best"]

    def policy(self) -> MLPPolicy:
        return _policy(self._weights)

    def is_finite(self) -> bool:
        return bool(np.isfinite(self._weights).all())

    def close(self) -> None:
        pass


def _policy(weights: np.ndarray) -> MLPPolicy:
    none = jnp.zeros(2, jnp.float32)
    return MLPPolicy((jnp.asarray(weights),), (jnp.zeros(1, jnp.float32),), none, none + 1)
