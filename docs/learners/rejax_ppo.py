"""PPO of rejax, the whole training compiled, on GymnaxEnv in the protocol of gymnax 0.0.9.

`pip install "stickslip[gymnax]" rejax`, then `python rejax_ppo.py [STEPS]`.
"""

import sys

import jax
import jax.numpy as jnp
from rejax import PPO

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import GymnaxEnv, task_by_name

TASK = "BipedSteady-v0"
STEPS = int(sys.argv[1]) if sys.argv[1:] else 2_000_000

env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still
sizes = {"num_envs": 256, "num_steps": 32, "num_minibatches": 16, "num_epochs": 6}
rates = {"learning_rate": 1e-3, "gamma": 0.98, "ent_coef": 0.0, "max_grad_norm": 0.5}
learner = PPO.create(
    env=GymnaxEnv(env, short, values=5),
    env_params=short,
    agent_kwargs={"activation": "tanh"},
    total_timesteps=STEPS,
    eval_freq=STEPS,
    **sizes,
    **rates,
)
learner = learner.replace(eval_callback=lambda *_: (), skip_initial_evaluation=True)
state, _ = jax.jit(learner.train)(jax.random.key(0))

actor = state.actor_ts.params["params"]
layers = actor["features"]["Dense_0"], actor["features"]["Dense_1"], actor["action_mean"]
weights, biases = (tuple(layer[name] for layer in layers) for name in ("kernel", "bias"))
policy = MLPPolicy(weights, biases, jnp.zeros(6), jnp.ones(6))
found = evaluate_task(TASK, {"ppo": policy}).row(TASK, "ppo")
print(f"score {found.metrics['task_score'].value:.3f}")
