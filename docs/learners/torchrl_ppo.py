"""PPO of TorchRL: its collector, advantages and loss on `gymnasium`'s vector environment.

`pip install "stickslip[torchrl]"`, then `python torchrl_ppo.py [STEPS]`; STEPS: of all
environments.
"""

import sys

import jax.numpy as jnp
import torch
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper
from torchrl.modules import MLP, IndependentNormal, ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import GymVectorEnv, task_by_name

TASK, N, T = "BipedSteady-v0", 64, 32
STEPS = int(sys.argv[1]) if sys.argv[1:] else 262_144
env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still
envs = GymVectorEnv(env, short, N, "same_step")
torch.manual_seed(0)
torch.set_num_threads(1)
shape = {"in_features": 6, "num_cells": [64, 64], "activation_class": nn.Tanh}
net = MLP(out_features=2, **shape)  # mean and deviation of the action
both = nn.Sequential(net, NormalParamExtractor(scale_mapping="biased_softplus_0.3"))
actor = ProbabilisticActor(
    TensorDictModule(both, ["observation"], ["loc", "scale"]),
    in_keys=["loc", "scale"],
    distribution_class=IndependentNormal,
    return_log_prob=True,
)
critic = ValueOperator(MLP(out_features=1, **shape))
gains = GAE(gamma=0.98, lmbda=0.95, value_network=critic)
loss = ClipPPOLoss(actor, critic, entropy_bonus=False, normalize_advantage=True)
optimiser = torch.optim.Adam(loss.parameters(), 1e-3)
envs = GymWrapper(envs, device="cpu")
frames = max(1, STEPS // (N * T)) * N * T
for rows in Collector(envs, actor, frames_per_batch=N * T, total_frames=frames):
    with torch.no_grad():
        gains(rows)
    rows = rows.reshape(-1)
    for batch in torch.cat([torch.randperm(len(rows)) for _ in range(6)]).split(512):
        found = loss(rows[batch])
        optimiser.zero_grad()
        (found["loss_objective"] + found["loss_critic"]).backward()
        nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
        optimiser.step()

arrays = [one.detach().numpy() for one in net.parameters()]
weights, biases = [one.T for one in arrays[::2]], arrays[1::2]
weights[-1], biases[-1] = weights[-1][:, :1], biases[-1][:1]
policy = MLPPolicy(tuple(weights), tuple(biases), jnp.zeros(6), jnp.ones(6))
found = evaluate_task(TASK, {"ppo": policy}).row(TASK, "ppo")
print(f"score {found.metrics['task_score'].value:.3f}")
