"""PPO of rsl_rl: its runner on a vector environment of tensors over `gymnasium.make_vec`'s.

`pip install stickslip rsl-rl-lib`, then `python rsl_rl_ppo.py [STEPS]`; STEPS: of all
environments.
"""

import sys

import jax.numpy as jnp
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import GymVectorEnv, task_by_name

TASK, N, T = "BipedSteady-v0", 256, 32
STEPS = int(sys.argv[1]) if sys.argv[1:] else 2_000_000
env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still


class Biped(VecEnv):
    """The task in rsl_rl's form."""

    num_envs, num_actions, max_episode_length, device, cfg = N, 1, 75, "cpu", {}

    def __init__(self):
        self.envs = GymVectorEnv(env, short, N, "same_step")
        self.obs, self.episode_length_buf = self.envs.reset(seed=0)[0], torch.zeros(N)

    def get_observations(self):
        return TensorDict({"all": torch.tensor(self.obs)}, [N])

    def step(self, actions):
        self.obs, reward, terminated, truncated, _ = self.envs.step(actions.numpy())
        ends = {"time_outs": torch.tensor(truncated & ~terminated)}
        done = torch.tensor(terminated | truncated)
        return self.get_observations(), torch.tensor(reward).float(), done, ends


torch.manual_seed(0)
torch.set_num_threads(1)
net = {"class_name": "MLPModel", "hidden_dims": [64, 64], "activation": "tanh"}
noise = {"class_name": "GaussianDistribution", "init_std": 0.3}
rates = {"class_name": "PPO", "gamma": 0.98, "entropy_coef": 0.0}
config = {"obs_groups": {"actor": ["all"], "critic": ["all"]}, "num_steps_per_env": T}
config |= {"actor": net | {"distribution_cfg": noise}, "critic": net, "algorithm": rates}
runner = OnPolicyRunner(Biped(), config | {"save_interval": STEPS})
runner.learn(max(1, STEPS // (N * T)))

arrays = [one.detach().numpy() for one in runner.get_inference_policy().mlp.parameters()]
layers = tuple(one.T for one in arrays[::2]), tuple(arrays[1::2])
found = evaluate_task(TASK, {"ppo": MLPPolicy(*layers, jnp.zeros(6), jnp.ones(6))}).row(TASK, "ppo")
print(f"score {found.metrics['task_score'].value:.3f}")
