"""A multilayer perceptron as a controller."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.envs.functional import POSITIVE
from stickslip.envs.history import MOST_FRAMES, pushed, stacked

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.agents.protocol import Action, Obs

ACTIVATIONS = {"tanh": jnp.tanh, "relu": jax.nn.relu}
FARTHEST = 1e6
"""Observations up to this are certain to have a finite action; the environments' are below."""
MOST = float(np.finfo(np.float32).max) / 2


@pytree_dataclass
class MLPPolicy:
    """Deterministic policy: action = squash(W_n h(... h(W_1 x + b_1) ...) + b_n).

    x = (observation - shift) / scale, then clipped to +- observation_clip unless that is None.
    weights: [inputs, outputs] of each layer; biases: [outputs]; shift, scale: [inputs].
    activation: "tanh" or "relu" (h). squash: "clip" to [-1, 1] or "tanh". Computes in the weights'
    type. history: steps before, whose observations and actions `act` stacks behind the observation
    as FrameStack does; x has them, too. 0: the policy remembers nothing.
    """

    weights: tuple[Array, "..."]
    biases: tuple[Array, "..."]
    shift: Array
    scale: Array
    activation: str = field(default="tanh", metadata={"static": True})
    squash: str = field(default="clip", metadata={"static": True})
    observation_clip: float | None = field(default=None, metadata={"static": True})
    history: int = field(default=0, metadata={"static": True})

    @property
    def layer_sizes(self) -> tuple[int, ...]:
        """Number of inputs, then of outputs of every layer."""
        return (np.shape(self.weights[0])[-2], *(np.shape(w)[-1] for w in self.weights))

    @property
    def observation_size(self) -> int:
        """Number of entries of the environment's observation."""
        inputs, actions = self.layer_sizes[0], self.layer_sizes[-1]
        return (inputs - self.history * actions) // (1 + self.history)

    def validate(self) -> MLPPolicy:
        """Return self, or raise ValueError naming what does not fit."""
        checks.require_choice("activation", self.activation, tuple(ACTIVATIONS))
        checks.require_choice("squash", self.squash, ("clip", "tanh"))
        if self.observation_clip is not None:
            accepted = "None, or finite and > 0"
            checks.require_kind("observation_clip", self.observation_clip, (int, float), accepted)
            rule = {"low": 0.0, "strict": True, "dtype": np.float32, "accepted": accepted}
            checks.require_number("observation_clip", self.observation_clip, **rule)
        for name in ("weights", "biases"):
            checks.require_kind(name, getattr(self, name), (tuple, list), "a tuple of arrays")
        if not self.weights or len(self.weights) != len(self.biases):
            given = f"{len(self.weights)} weights with {len(self.biases)} biases"
            raise ValueError(f"{given}; accepted: as many of each, at least one")
        self._check_shapes()
        checks.require_integer("history", self.history, low=0, high=MOST_FRAMES)
        inputs, actions, seen = self.layer_sizes[0], self.layer_sizes[-1], self.observation_size
        if seen < 1 or inputs != seen + self.history * (seen + actions):
            raise ValueError(
                f"history = {self.history} with {inputs} inputs and {actions} outputs; accepted: "
                "n + history * (n + outputs) inputs, of an observation of n numbers"
            )
        if checks.is_concrete(self):
            self._check_numbers()
        return self

    def init(self, env_params: object = None, env_state: object = None) -> Array | None:
        """The frames at the start of an episode, zeros [history, frame]; None without history."""
        if not self.history:
            return None
        width = self.observation_size + self.layer_sizes[-1]
        return jnp.zeros((self.history, width), jnp.result_type(self.weights[0]))

    def act(
        self, memory: Array | None, obs: Obs, env_state: object = None, env_params: object = None
    ) -> tuple[Array | None, Action]:
        """See Controller. Without history, observations may have leading batch axes here."""
        if memory is None:
            return memory, self(obs)
        action = self(stacked(obs, memory))
        return pushed(memory, obs, action), action

    def __call__(self, obs: Float[Array, "*batch in"]) -> Float[Array, "*batch act"]:
        """The actions for observations, stacked ones of a policy with history."""
        x = self.unlimited(obs)
        x = jnp.tanh(x) if self.squash == "tanh" else jnp.clip(x, -1.0, 1.0)
        return x.astype(jnp.asarray(obs).dtype)

    def unlimited(self, obs: Float[Array, "*batch obs"]) -> Float[Array, "*batch out"]:
        """Output of the last layer, in the weights' type: the actions before `squash`."""
        size = self.layer_sizes[0]
        if np.shape(obs)[-1:] != (size,):
            raise ValueError(
                f"observation has shape {np.shape(obs)}; accepted by this policy: {size} entries, "
                f"{'which `act` stacks' if self.history else 'as another environment has'}"
            )
        given = jnp.asarray(obs)
        x = (given.astype(jnp.result_type(self.weights[0])) - self.shift) / self.scale
        if self.observation_clip is not None:
            x = jnp.clip(x, -self.observation_clip, self.observation_clip)
        last = len(self.weights) - 1
        for index, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = jnp.matmul(x, weight, precision="highest") + bias
            x = x if index == last else ACTIVATIONS[self.activation](x)
        return x

    def _check_shapes(self) -> None:
        width = None
        for index, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            shape = np.shape(weight)
            if len(shape) != 2 or 0 in shape or (width is not None and shape[0] != width):
                rows = "inputs" if width is None else width
                raise ValueError(f"weight {index} has shape {shape}; accepted: ({rows}, outputs)")
            width = shape[1]
            if np.shape(bias) != (width,):
                raise ValueError(f"bias {index} has shape {np.shape(bias)}; accepted: ({width},)")
        for name in ("shift", "scale"):
            shape = np.shape(getattr(self, name))
            if shape != self.layer_sizes[:1]:
                raise ValueError(f"{name} has shape {shape}; accepted: {self.layer_sizes[:1]}")

    def _check_numbers(self) -> None:
        """Require finite numbers, a scale > 0 in float32, and actions that cannot overflow."""
        named = {f"weight {i}": w for i, w in enumerate(self.weights)}
        named |= {f"bias {i}": b for i, b in enumerate(self.biases)} | {"shift": self.shift}
        for name, values in named.items():
            checks.require_number(name, values, accepted="finite numbers")
        checks.require_number("scale", self.scale, dtype=np.float32, **POSITIVE)
        clip = np.inf if self.observation_clip is None else self.observation_clip
        shift, scale = (np.abs(np.asarray(one, float)) for one in (self.shift, self.scale))
        highest = np.minimum((FARTHEST + shift) / scale, clip)
        for index, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            sums = highest @ np.abs(np.asarray(weight, float)) + np.abs(np.asarray(bias, float))
            if not np.max(sums) < MOST:
                raise ValueError(
                    f"weight {index} lets its layer reach {np.max(sums):.3g} for observations of "
                    f"up to {FARTHEST:g}; accepted: weights with which it stays below {MOST:.3g}"
                )
            highest = np.ones_like(sums) if self.activation == "tanh" else sums
