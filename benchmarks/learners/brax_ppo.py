"""PPO of brax over `BraxEnv`.

brax 0.14.2 calls jax.device_put_replicated, which JAX took away in 0.10; `replicated` stands in for
it here. Its networks are tanh perceptrons of our widths, their output squashed by tanh; it learns
the noise, of which it has one for each observation.
"""

from __future__ import annotations

import functools
from importlib import import_module
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp

from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.envs.adapters.brax import BraxEnv, fresh_episodes

if TYPE_CHECKING:
    from benchmarks.learners.race import Race

PPO = "brax.training.agents.ppo"
EVALUATIONS = 48


class Over(Exception):  # noqa: N818, an end and no error
    """Raised in brax's callback, which cannot say that it is enough."""


def replicated(tree: Any, devices: Any) -> Any:
    """As jax.device_put_replicated was: a copy for each device, along a new first axis."""
    return jax.tree.map(lambda x: jnp.stack([jnp.asarray(x)] * len(devices)), tree)


def brax_ppo(race: Race) -> None:
    """With the sizes and rates of ours as far as it has them."""
    networks, train = (import_module(f"{PPO}.{name}") for name in ("networks", "train"))
    if not hasattr(jax, "device_put_replicated"):
        jax.device_put_replicated = replicated
    config, ppo = race.config, race.config.ppo
    env = BraxEnv(race.env, race.params)
    widths = (config.hidden,) * config.layers
    factory = functools.partial(
        networks.make_ppo_networks,
        policy_hidden_layer_sizes=widths,
        value_hidden_layer_sizes=widths,
        activation=jnp.tanh,
    )

    def tell(steps: int, make: object, params: Any) -> None:
        if steps and race.tell(steps, policy_of(params, env.action_size)):
            raise Over

    race.start()
    try:
        train.train(
            env,
            num_timesteps=config.timesteps,
            episode_length=env.episode_length,
            wrap_env_fn=fresh_episodes,
            num_envs=config.num_envs,
            unroll_length=ppo.rollout_steps,
            batch_size=config.batch_size // ppo.rollout_steps,
            num_minibatches=config.num_envs * ppo.rollout_steps // config.batch_size,
            num_updates_per_batch=ppo.epochs,
            learning_rate=config.learning_rate,
            discounting=config.discount,
            gae_lambda=ppo.gae_lambda,
            clipping_epsilon=ppo.clip_range,
            max_grad_norm=0.5,
            entropy_cost=1e-4,
            normalize_observations=True,
            network_factory=factory,
            num_evals=EVALUATIONS + 1,
            run_evals=False,
            policy_params_fn=tell,
            seed=race.seed,
        )
    except Over:
        return


def policy_of(params: Any, actions: int) -> MLPPolicy:
    """The mode of brax's policy: the first half of what its last layer gives, through tanh."""
    seen, layers = params[0], params[1]["params"]
    names = sorted(layers, key=lambda name: int(name.rpartition("_")[2]))
    weights = [layers[name]["kernel"] for name in names]
    biases = [layers[name]["bias"] for name in names]
    weights[-1], biases[-1] = weights[-1][:, :actions], biases[-1][:actions]
    return MLPPolicy(tuple(weights), tuple(biases), seen.mean, seen.std, squash="tanh").validate()
