"""PPO of brax, which begins and truncates the episodes itself.

`pip install stickslip brax "jax<0.10"`, then `python brax_ppo.py [STEPS]`; STEPS: of all
environments.
"""

import sys
from functools import partial

import jax.numpy as jnp
from brax.envs.base import Env, State
from brax.training.agents.ppo.networks import linen, make_ppo_networks
from brax.training.agents.ppo.train import train

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import task_by_name

TASK = "BipedSteady-v0"
STEPS = int(sys.argv[1]) if sys.argv[1:] else 2_000_000
env, params = task_by_name(TASK).make("disabled")
params = params.replace(fall_penalty=1.0)  # with short episodes: else it learns to stand still


class Biped(Env):
    """The task in brax's form."""

    observation_size, action_size, backend = 6, 1, "stickslip"

    def reset(self, rng):
        obs, state = env.reset(rng, params)
        return State(state, obs, jnp.zeros(()), jnp.zeros(()))

    def step(self, state, action):
        obs, after, reward, over, _, _ = env.step(None, state.pipeline_state, action, params)
        return state.replace(pipeline_state=after, obs=obs, reward=reward, done=1.0 * over)


noise = {"distribution_type": "normal", "noise_std_type": "log", "init_noise_std": 0.3}
sizes = {"policy_hidden_layer_sizes": (64, 64), "value_hidden_layer_sizes": (64, 64)}
networks = partial(make_ppo_networks, activation=linen.tanh, **noise, **sizes)
batch = {"num_envs": 512, "episode_length": 75, "unroll_length": 32, "batch_size": 64}
rates = {"learning_rate": 1e-3, "discounting": 0.98, "entropy_cost": 0.0, "clipping_epsilon": 0.2}
updates = {"num_minibatches": 8, "num_updates_per_batch": 6, "run_evals": False}
_, learnt, _ = train(Biped(), STEPS, network_factory=networks, **batch, **rates, **updates)

mean = learnt[1]["params"]
layers = mean["MLP_0"]["hidden_0"], mean["MLP_0"]["hidden_1"], mean["Dense_0"]
weights, biases = (tuple(layer[name] for layer in layers) for name in ("kernel", "bias"))
policy = MLPPolicy(weights, biases, jnp.zeros(6), jnp.ones(6))
found = evaluate_task(TASK, {"ppo": policy}).row(TASK, "ppo")
print(f"score {found.metrics['task_score'].value:.3f}")
