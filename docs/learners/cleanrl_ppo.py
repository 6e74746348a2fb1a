"""PPO in CleanRL's style: one PyTorch loop over `gymnasium.make_vec`.

`pip install stickslip torch`, then `python cleanrl_ppo.py [STEPS]`; STEPS: of all environments.
"""

import sys
from math import pi

import gymnasium
import numpy as np
import torch
from torch import nn

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import Randomisation

TASK, N, T = "BipedSteady-v0", 64, 32
STEPS = int(sys.argv[1]) if sys.argv[1:] else 1_000_000
starts = Randomisation(phase=(pi / 2, 3 * pi / 2), crank_rate=(0.0, 3.0))  # the task's
short = {"randomisation": starts, "time_limit": 1.5, "fall_penalty": 1.0}  # else it stands still
envs = gymnasium.make_vec("stickslip/Biped-v0", num_envs=N, autoreset_mode="same_step", **short)
torch.manual_seed(0)
torch.set_num_threads(1)
actor, critic = (
    nn.Sequential(nn.Linear(6, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1))
    for _ in range(2)
)
log_std = nn.Parameter(torch.tensor(-1.0))
weights = [*actor.parameters(), *critic.parameters(), log_std]
optimiser = torch.optim.Adam(weights, 1e-3)
obs = torch.tensor(envs.reset(seed=0)[0])
for _ in range(max(1, STEPS // (N * T))):
    rows = []
    with torch.no_grad():
        for _ in range(T):
            noisy = torch.distributions.Normal(actor(obs), log_std.exp())
            action = noisy.sample()
            after, reward, terminated, truncated, info = envs.step(action.numpy())
            last = after.copy()
            if (over := terminated | truncated).any():
                last[over] = np.stack(info["final_obs"][over])
            ahead = critic(torch.tensor(last))[:, 0] * torch.tensor(~terminated)
            error = torch.tensor(reward).float() + 0.98 * ahead - critic(obs)[:, 0]
            rows.append((obs, action, noisy.log_prob(action)[:, 0], error, torch.tensor(~over)))
            obs = torch.tensor(after)
        seen, actions, before, gains, goes_on = map(torch.stack, zip(*rows, strict=True))
        for t in reversed(range(T - 1)):
            gains[t] += 0.98 * 0.95 * goes_on[t] * gains[t + 1]
        targets = critic(seen)[..., 0] + gains
    rows = [one.flatten(0, 1) for one in (seen, actions, before, gains, targets)]
    for batch in torch.cat([torch.randperm(N * T) for _ in range(6)]).split(512):
        seen, actions, before, gains, targets = (one[batch] for one in rows)
        now = torch.distributions.Normal(actor(seen), log_std.exp()).log_prob(actions)[:, 0]
        ratio, gains = (now - before).exp(), (gains - gains.mean()) / gains.std()
        won = torch.minimum(ratio * gains, ratio.clamp(0.8, 1.2) * gains).mean()
        loss = (critic(seen)[:, 0] - targets).square().mean() - won
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(weights, 0.5)
        optimiser.step()

arrays = [one.detach().numpy() for one in actor.parameters()]
layers = tuple(one.T for one in arrays[::2]), tuple(arrays[1::2])
policy = MLPPolicy(*layers, np.zeros(6, np.float32), np.ones(6, np.float32))
found = evaluate_task(TASK, {"ppo": policy}).row(TASK, "ppo")
print(f"score {found.metrics['task_score'].value:.3f}")
