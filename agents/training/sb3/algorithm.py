"""PPO and SAC of Stable-Baselines3 from a configuration, and their state as arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import set_random_seed

if TYPE_CHECKING:
    from collections.abc import Callable

    from stable_baselines3.common.buffers import ReplayBuffer
    from stable_baselines3.common.vec_env import VecEnv

    from stickslip.agents.training.checkpoint import ModelState
    from stickslip.agents.training.groups import LearningConfiguration


BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer."""
LOSSES = {
    "ppo": {
        "policy_loss": "policy_gradient_loss",
        "value_loss": "value_loss",
        "kl_divergence": "approx_kl",
        "clip_fraction": "clip_fraction",
        "explained_variance": "explained_variance",
    },
    "sac": {
        "actor_loss": "actor_loss",
        "critic_loss": "critic_loss",
        "entropy_weight": "ent_coef",
    },
}
"""Columns of the metrics and what Stable-Baselines3 logs them as."""


@dataclass
class Course:
    """Progress of a run, for schedules. share: 0 to 1."""

    share: float = 0.0

    def between(self, first: float, last: float) -> float:
        """From first to last, linearly."""
        return first + (last - first) * min(max(self.share, 0.0), 1.0)


def make_model(config: LearningConfiguration, envs: VecEnv, course: Course) -> PPO | SAC:
    """A fresh model whose learning rate follows the course."""
    torch.set_num_threads(config.threads)
    network = {"net_arch": [config.hidden] * config.layers}
    common: dict[str, Any] = {
        "learning_rate": lambda _: course.between(config.learning_rate, config.final_learning_rate),
        "batch_size": config.batch_size,
        "gamma": config.discount,
        "seed": config.seed,
        "device": "cpu",
    }
    if config.algorithm == "sac":
        model = SAC(
            "MlpPolicy",
            envs,
            buffer_size=config.sac.buffer_size,
            learning_starts=config.sac.learning_starts,
            gradient_steps=config.sac.gradient_steps,
            tau=config.sac.soft_update,
            train_freq=1,
            policy_kwargs=network,
            **common,
        )
    else:
        model = PPO(
            "MlpPolicy",
            envs,
            n_steps=config.ppo.rollout_steps,
            n_epochs=config.ppo.epochs,
            gae_lambda=config.ppo.gae_lambda,
            clip_range=config.ppo.clip_range,
            policy_kwargs=network | {"log_std_init": math.log(config.ppo.noise)},
            **common,
        )
        model.policy.log_std.requires_grad_(False)
    model.set_logger(Logger(folder=None, output_formats=[]))
    return model


def set_noise(model: PPO | SAC, config: LearningConfiguration, course: Course) -> float:
    """Set the exploration that the course prescribes, and return it (NaN for SAC, which learns it).

    Learnt, it vanishes within the first half million steps: standing still is then a safe local
    optimum, since it takes a large torque at the right phase to get over the first step.
    """
    if not isinstance(model, PPO):
        return math.nan
    logarithm = course.between(math.log(config.ppo.noise), math.log(config.ppo.final_noise))
    model.policy.log_std.data.fill_(logarithm)
    return math.exp(logarithm)


def begin_stretch(model: PPO | SAC, seed: int, timesteps: int) -> None:
    """Start every random generator and every environment anew from the seed and the steps so far.

    So what follows a checkpoint depends on nothing but the checkpoint.
    """
    first, second = np.random.SeedSequence([seed, timesteps]).generate_state(2)
    set_random_seed(int(first))
    model.action_space.seed(int(first))
    envs = model.get_env()
    if envs is not None:
        envs.seed(int(second) % 2**30)
    model.num_timesteps = timesteps
    model._last_obs = None  # so that learn() resets the environments


def take_state(model: PPO | SAC) -> ModelState:
    """Parameters, optimiser states and (SAC) the replay buffer: arrays in plain containers."""
    state: ModelState = {
        "algorithm": type(model).__name__,
        "parameters": _as_arrays(model.get_parameters()),
        "updates": int(model._n_updates),
    }
    if isinstance(model, SAC):
        buffer = _buffer(model)
        rows = buffer.buffer_size if buffer.full else buffer.pos
        state["log_ent_coef"] = _as_arrays(_entropy(model))
        state["buffer"] = {name: getattr(buffer, name)[:rows].copy() for name in BUFFER}
        state["buffer_position"], state["buffer_full"] = buffer.pos, bool(buffer.full)
    return state


def put_state(model: PPO | SAC, state: dict[str, Any]) -> None:
    """Undo `take_state`. ValueError if the state is of another model."""
    try:
        if state["algorithm"] != type(model).__name__:
            raise ValueError(f"it is of {state['algorithm']!r}, this run is {type(model).__name__}")
        model.set_parameters(_as_tensors(state["parameters"]), exact_match=True, device="cpu")
        model._n_updates = int(state["updates"])
        if isinstance(model, SAC):
            _entropy(model).data.copy_(_as_tensors(state["log_ent_coef"]))
            _fill(_buffer(model), state)
    except Exception as error:  # whatever PyTorch makes of what is not its own
        reason = str(error).partition("\n")[0]
        raise ValueError(f"its contents do not fit the configuration ({reason})") from error


def is_finite(model: PPO | SAC) -> bool:
    """True if every parameter is."""
    return all(bool(torch.isfinite(p).all()) for p in model.policy.parameters())


def _buffer(model: SAC) -> ReplayBuffer:
    if model.replay_buffer is None:
        raise ValueError("a model without its replay buffer; accepted: one that is set up")
    return model.replay_buffer


def _entropy(model: SAC) -> torch.Tensor:
    """Logarithm of the entropy's weight, which SAC learns here."""
    if model.log_ent_coef is None:
        raise ValueError("the entropy's weight is fixed; accepted: one that is learnt")
    return model.log_ent_coef


def _fill(buffer: ReplayBuffer, state: dict[str, Any]) -> None:
    for name in BUFFER:
        rows, target = state["buffer"][name], getattr(buffer, name)
        if rows.shape[1:] != target.shape[1:] or len(rows) > len(target):
            raise ValueError(f"buffer {name} has shape {rows.shape}, this run's {target.shape}")
        target[: len(rows)] = rows
    buffer.pos, buffer.full = int(state["buffer_position"]), bool(state["buffer_full"])


def _as_arrays(tree: Any) -> Any:
    """Plain containers with an array in the place of each tensor."""
    if isinstance(tree, torch.Tensor):
        return np.array(tree.detach().cpu().numpy(), order="C")
    return _mapped(_as_arrays, tree)


def _as_tensors(tree: Any) -> Any:
    """Plain containers with a tensor in the place of each array."""
    if isinstance(tree, np.ndarray):
        return torch.from_numpy(tree.copy())
    return _mapped(_as_tensors, tree)


def _mapped(change: Callable[[Any], Any], tree: Any) -> Any:
    if isinstance(tree, dict):
        return {name: change(value) for name, value in tree.items()}
    return type(tree)(map(change, tree)) if isinstance(tree, list | tuple) else tree
