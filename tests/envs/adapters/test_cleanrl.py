"""Gymnasium's vector wrappers over our vector environment, in a loop as CleanRL writes it."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import (
    ClipAction,
    NormalizeObservation,
    RecordEpisodeStatistics,
    RescaleAction,
)

import stickslip  # noqa: F401  (registers the environments)
from tests.envs.adapters.tiny import BIPED, IDLE, LEARNT, hurry, mean_return
from tests.extras import SB3

NUM_ENVS, STEPS = 32, 16


def wrapped():
    envs = gymnasium.make_vec(BIPED, num_envs=NUM_ENVS, **hurry())
    return NormalizeObservation(ClipAction(RecordEpisodeStatistics(envs)))


@pytest.mark.long
def test_statistics_are_those_that_the_environment_keeps():
    envs = wrapped()
    envs.reset(seed=0)
    for _ in range(15):
        _, _, _, truncated, infos = envs.step(np.full((NUM_ENVS, 1), 0.1, np.float32))
    assert truncated.all()
    np.testing.assert_allclose(infos["episode"]["l"], 15)
    np.testing.assert_allclose(infos["episode"]["r"], infos["episode_return"], atol=1e-5)


def test_actions_beyond_the_limits_saturate_and_others_are_rescaled():
    plain = gymnasium.make_vec(BIPED, num_envs=NUM_ENVS, **hurry())
    limits = np.float32([-10.0]), np.float32([10.0])
    results = []
    for envs, action in ((wrapped().env, 3.0), (plain, 3.0), (RescaleAction(plain, *limits), 10.0)):
        envs.reset(seed=0)
        results.append(envs.step(np.full((NUM_ENVS, 1), action, np.float32))[0])
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[2], results[1])


@SB3
def test_ppo_in_a_loop_of_ones_own_learns():
    import torch

    torch.manual_seed(0)
    torch.set_num_threads(1)
    envs = wrapped()
    actor, critic = (
        torch.nn.Sequential(torch.nn.Linear(6, 16), torch.nn.Tanh(), torch.nn.Linear(16, 1))
        for _ in range(2)
    )
    adam = torch.optim.Adam([*actor.parameters(), *critic.parameters()], lr=1e-2)
    obs = torch.as_tensor(envs.reset(seed=0)[0], dtype=torch.float32)
    returns, fresh = [], np.zeros(NUM_ENVS, bool)
    for _ in range(30):
        rows = []
        for _ in range(STEPS):
            with torch.no_grad():
                chosen = torch.distributions.Normal(actor(obs), 0.3)
                action = chosen.sample()
                value = critic(obs)[:, 0]
            after, reward, terminated, truncated, infos = envs.step(action.numpy())
            over = terminated | truncated
            after = torch.as_tensor(after, dtype=torch.float32)
            with torch.no_grad():
                surprise = torch.as_tensor(reward).float() - value
                surprise += 0.9 * critic(after)[:, 0] * torch.as_tensor(~terminated)
            rows.append((obs, action, chosen.log_prob(action)[:, 0], value, surprise, over, fresh))
            obs, fresh = after, over
            returns += list(infos["episode"]["r"][over]) if over.any() else []
        improve(actor, critic, adam, rows)
    envs.update_running_mean = False

    def act(obs):
        with torch.no_grad():
            return actor(torch.as_tensor(obs, dtype=torch.float32)).numpy()

    assert len(returns) >= 10 * NUM_ENVS
    assert mean_return(lambda obs: np.zeros((NUM_ENVS, 1)), envs) == pytest.approx(IDLE, abs=0.02)
    assert mean_return(act, envs) > LEARNT


def improve(actor, critic, adam, rows) -> None:
    """Generalised advantages, and passes over the whole rollout; rows: see the loop."""
    import torch

    gains, gain = [], torch.zeros(NUM_ENVS)
    for *_, surprise, over, _ in reversed(rows):
        gain = surprise + 0.9 * 0.95 * gain * torch.as_tensor(~over)
        gains.insert(0, gain)
    taught = ~np.concatenate([row[-1] for row in rows])  # a step that resets teaches nothing
    columns = (*list(zip(*rows, strict=True))[:4], gains)
    seen, acted, before, value, gain = (torch.cat(column)[taught] for column in columns)
    target = value + gain
    gain = (gain - gain.mean()) / (gain.std() + 1e-8)
    for _ in range(8):
        now = torch.distributions.Normal(actor(seen), 0.3).log_prob(acted)[:, 0]
        ratio = (now - before).exp()
        loss = -torch.minimum(ratio * gain, ratio.clamp(0.8, 1.2) * gain).mean()
        loss = loss + 0.5 * ((critic(seen)[:, 0] - target) ** 2).mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
