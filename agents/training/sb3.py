"""PPO of Stable-Baselines3 as a trainer, on the processor; its state as arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import set_random_seed

from stickslip.agents.policy.exchange import from_sb3
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.training.trainer import UNFIT, ModelState, Trainer, Update
from stickslip.envs.adapters.sb3 import SB3VecEnv

LOSSES = {
    "policy_loss": "policy_gradient_loss",
    "value_loss": "value_loss",
    "kl_divergence": "approx_kl",
    "clip_fraction": "clip_fraction",
    "explained_variance": "explained_variance",
}
"""Columns of the metrics and what Stable-Baselines3 logs them as."""


def _by_parameter(tensors: dict[str, torch.Tensor]) -> dict[int, dict[str, torch.Tensor]]:
    """An optimiser's state from what `SB3Trainer.take_state` made of it."""
    found: dict[int, dict[str, torch.Tensor]] = {}
    for path, tensor in tensors.items():
        index, _, name = path.partition("/")
        found.setdefault(int(index), {})[name] = tensor
    return found


class Reporter(BaseCallback):
    """Sets the schedules before each rollout, and reports after updates.

    A stop gives an unfinished rollout up, so `num_timesteps` is that of the last update.
    """

    def __init__(self, trainer: SB3Trainer):
        super().__init__()
        self._trainer, self._config = trainer, trainer.config
        self._ended: list[dict[str, Any]] = []
        self._reported_at, self._noise = 0, math.nan

    def _on_training_start(self) -> None:
        self._reported_at = self.model.num_timesteps
        self._ended.clear()

    def _on_rollout_start(self) -> None:
        self._report()
        self._trainer.share = self.model.num_timesteps / self._config.timesteps
        self._noise = self._trainer.set_noise()

    def _on_step(self) -> bool:
        for index in np.flatnonzero(self.locals["dones"]):
            self._ended.append(self.locals["infos"][index])
        if self._trainer.stop():
            self.model.num_timesteps = self._reported_at
            self._trainer.stopped = True
        return not self._trainer.stopped

    def _on_training_end(self) -> None:
        if not self._trainer.stopped:
            self._report()

    def _report(self) -> None:
        """Report the last update, if there was one."""
        if self.model.num_timesteps == self._reported_at:
            return
        self._reported_at = self._trainer.timesteps = self.model.num_timesteps
        logged = self.model.logger.name_to_value
        losses = {name: float(logged.get(f"train/{key}", np.nan)) for name, key in LOSSES.items()}
        first = self._ended[0] if self._ended else {}
        names = [name for name, value in first.items() if isinstance(value, bool | int | float)]
        update = Update(
            timesteps=self.model.num_timesteps,
            learning_rate=self.model.lr_schedule(1.0),
            noise=self._noise,
            ended={name: np.asarray([info[name] for info in self._ended]) for name in names},
            losses=losses,
        )
        self._ended.clear()
        self._trainer.report(update)


class SB3Trainer(Trainer):
    """Stable-Baselines3's PPO on the processor, in one thread of PyTorch."""

    losses = tuple(LOSSES)
    share = 0.0
    """Share of the training done so far, 0 to 1; rates and noise follow it."""

    def build(self) -> None:
        config = self.config
        self._envs = SB3VecEnv(self.env, self.params, config.num_envs, config.seed)
        self._reporter = Reporter(self)
        torch.set_num_threads(1)
        rates = config.learning_rate, config.final_learning_rate
        layers, noise = [config.hidden] * config.layers, math.log(config.noise)
        self._model = PPO(
            "MlpPolicy",
            self._envs,
            learning_rate=lambda _: self._between(*rates),
            n_steps=config.rollout_steps,
            batch_size=config.batch_size,
            n_epochs=config.epochs,
            gamma=config.discount,
            gae_lambda=config.gae_lambda,
            clip_range=config.clip_range,
            policy_kwargs={"net_arch": layers, "log_std_init": noise},
            seed=config.seed,
            device="cpu",
        )
        self._model.policy.log_std.requires_grad_(False)
        self._model.set_logger(Logger(folder=None, output_formats=[]))

    def _between(self, first: float, last: float) -> float:
        """Linear schedule from first to last."""
        return first + (last - first) * min(max(self.share, 0.0), 1.0)

    def set_noise(self) -> float:
        """Set the scheduled exploration, and return it."""
        logarithm = self._between(math.log(self.config.noise), math.log(self.config.final_noise))
        self._model.policy.log_std.data.fill_(logarithm)
        return math.exp(logarithm)

    def begin_stretch(self) -> None:
        self.share = self.timesteps / self.config.timesteps
        key = [self.config.seed, self.timesteps]
        first, second = np.random.SeedSequence(key).generate_state(2)
        set_random_seed(int(first))
        self._model.action_space.seed(int(first))
        self._envs.seed(int(second) % 2**30)
        self._model.num_timesteps = self.timesteps
        self._model._last_obs = None  # so that learn() resets the environments

    def advance(self, goal: int) -> None:
        self._model.learn(
            goal - self.timesteps, self._reporter, log_interval=10**9, reset_num_timesteps=False
        )
        self.timesteps = self._model.num_timesteps

    def take_state(self) -> ModelState:
        state: dict[str, Any] = {"updates": int(self._model._n_updates)}
        for name, part in self._model.get_parameters().items():
            parts = part["state"] if name.endswith("optimizer") else {None: part}
            for i, own in parts.items():  # of an optimiser, by parameter
                at = name if i is None else f"{name}/{i}"
                arrays = {key: one.detach().cpu().numpy() for key, one in own.items()}
                state |= {f"{at}/{key}": np.array(of, order="C") for key, of in arrays.items()}
        return state

    def put_state(self, state: ModelState) -> None:
        parameters: Any = self._model.get_parameters()
        try:
            for name, part in parameters.items():
                own = {
                    key.removeprefix(f"{name}/"): torch.from_numpy(np.array(one))
                    for key, one in state.items()
                    if key.startswith(f"{name}/")
                }
                parameters[name] = own
                if name.endswith("optimizer"):
                    parameters[name] = {**part, "state": _by_parameter(own)}
            self._model.set_parameters(parameters, exact_match=True, device="cpu")
            self._model._n_updates = int(state["updates"])
        except Exception as error:  # whatever PyTorch makes of what is not its own
            reason = str(error).partition("\n")[0]
            raise ValueError(f"{UNFIT} ({reason})") from error

    def network(self) -> MLPPolicy:
        return from_sb3(self._model)

    def is_finite(self) -> bool:
        return all(bool(torch.isfinite(p).all()) for p in self._model.policy.parameters())
