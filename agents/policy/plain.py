"""A policy in NumPy alone: what a robot's computer needs, without JAX."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.agents.policy.mlp import MLPPolicy


@dataclass(frozen=True)
class PlainPolicy:
    """The same numbers as an MLPPolicy's, as NumPy's arrays; computes in the weights' type."""

    weights: tuple[np.ndarray, "..."]
    biases: tuple[np.ndarray, "..."]
    shift: np.ndarray
    scale: np.ndarray
    activation: str = "tanh"
    squash: str = "clip"
    observation_clip: float | None = None

    @classmethod
    def of(cls, policy: MLPPolicy) -> PlainPolicy:
        """A policy's copy. ValueError for one that is no policy."""
        policy.validate()
        weights, biases = (tuple(map(np.asarray, one)) for one in (policy.weights, policy.biases))
        numbers = np.asarray(policy.shift), np.asarray(policy.scale)
        how = policy.activation, policy.squash, policy.observation_clip
        return cls(weights, biases, *numbers, *how)

    def __call__(self, obs: Float[np.ndarray, "*batch obs"]) -> Float[np.ndarray, "*batch act"]:
        """The actions for observations. ValueError for observations of another size."""
        given = np.asarray(obs, self.weights[0].dtype)
        if given.shape[-1:] != self.shift.shape:
            raise ValueError(
                f"observation has shape {given.shape}; accepted by this policy: "
                f"{len(self.shift)} entries"
            )
        x = (given - self.shift) / self.scale
        if self.observation_clip is not None:
            x = np.clip(x, -self.observation_clip, self.observation_clip)
        *inner, last = zip(self.weights, self.biases, strict=True)
        for weight, bias in inner:
            x = x @ weight + bias
            x = np.tanh(x) if self.activation == "tanh" else np.maximum(x, 0)
        x = x @ last[0] + last[1]
        return np.tanh(x) if self.squash == "tanh" else np.clip(x, -1, 1)
