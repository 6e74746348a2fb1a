"""SAC of Stable-Baselines3, and PPO and SAC of sbx, its counterpart in JAX, over our VecEnv."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp

from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.agents.policy.sb3 import from_sb3
from stickslip.envs import SB3VecEnv

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.learners.race import Race

SAC_STEPS, SAC_ENVS = 300_000, 16
"""The defaults of `stickslip train biped --algorithm sac`, here for both machines."""
SAC = {
    "batch_size": 256,
    "buffer_size": 300_000,
    "learning_starts": 10_000,
    "gradient_steps": 8,
    "train_freq": 1,
    "tau": 0.005,
}
EVERY = 100
"""Steps of all environments from one evaluation of SAC to the next."""


def sb3_sac(race: Race) -> None:
    """Stable-Baselines3's SAC."""
    import stable_baselines3
    import torch

    torch.set_num_threads(1)
    _sac(stable_baselines3.SAC, race, from_sb3)


def sbx_sac(race: Race) -> None:
    """The same in JAX."""
    _sac(
        import_module("sbx").SAC,
        race,
        lambda model: flax_policy(model.policy.actor_state.params, "relu", "tanh"),
    )


def sbx_ppo(race: Race) -> None:
    """PPO with the sizes and rates of ours; its noise is learnt, observations are as they are."""
    config, ppo = race.config, race.config.ppo
    race.start()
    model = import_module("sbx").PPO(
        "MlpPolicy",
        SB3VecEnv(race.env, race.params, config.num_envs, race.seed),
        learning_rate=falling(config.learning_rate, config.final_learning_rate),
        n_steps=ppo.rollout_steps,
        batch_size=config.batch_size,
        n_epochs=ppo.epochs,
        gamma=config.discount,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip_range,
        policy_kwargs={
            "net_arch": [config.hidden] * config.layers,
            "log_std_init": math.log(ppo.noise),
            "ortho_init": True,
        },
        seed=race.seed,
    )
    every = max(1, config.timesteps // 64 // (config.num_envs * ppo.rollout_steps))
    policy = lambda: flax_policy(model.policy.actor_state.params, "tanh", "clip")  # noqa: E731
    _learn(model, race, config.timesteps, every * ppo.rollout_steps, policy)


def _sac(kind: Any, race: Race, policy: Callable[[Any], MLPPolicy]) -> None:
    race.start()
    discount = 0.98 if race.task.machine == "biped" else race.config.discount
    model = kind(
        "MlpPolicy",
        SB3VecEnv(race.env, race.params, SAC_ENVS, race.seed),
        learning_rate=falling(1e-3, 3e-4),
        gamma=discount,
        policy_kwargs={"net_arch": [64, 64]},
        seed=race.seed,
        **SAC,
    )
    _learn(model, race, SAC_STEPS, EVERY, lambda: policy(model))


def _learn(model: Any, race: Race, steps: int, every: int, policy: Callable[[], MLPPolicy]) -> None:
    """Learn, and tell after so many steps of all environments."""
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import Logger

    class Tells(BaseCallback):
        def _on_step(self) -> bool:
            if self.n_calls % every:
                return True
            return not race.tell(self.num_timesteps, policy())

    model.set_logger(Logger(folder=None, output_formats=[]))  # or it leaves an empty folder
    model.learn(steps, Tells())


def falling(first: float, last: float) -> Callable[[float], float]:
    """A learning rate of what is left of the training, 1 to 0."""
    return lambda left: last + (first - last) * left


def flax_policy(params: Any, activation: str, squash: str) -> MLPPolicy:
    """The actor of sbx: its dense layers, of which SAC's last gives the spread."""
    layers = params["params"]
    names = sorted(name for name in layers if name.startswith("Dense"))[:3]
    weights, biases = zip(
        *[(layers[one]["kernel"], layers[one]["bias"]) for one in names], strict=True
    )
    inputs = weights[0].shape[0]
    return MLPPolicy(
        weights, biases, jnp.zeros(inputs), jnp.ones(inputs), activation=activation, squash=squash
    ).validate()
