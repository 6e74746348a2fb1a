"""TorchRL over the Gymnasium ids: its checks, how episodes end, and a short training."""

from __future__ import annotations

import importlib.util

import gymnasium
import pytest

import stickslip  # noqa: F401  (registers the environments)
from tests.envs.adapters.tiny import BIPED, IDLE, LEARNT, hurry

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        importlib.util.find_spec("torchrl") is None, reason="TorchRL is an extra of its own"
    ),
    pytest.mark.filterwarnings("default"),  # its own, of what becomes of its defaults
]


def made():
    import torch
    from torchrl.envs import GymWrapper

    torch.manual_seed(0)
    torch.set_num_threads(1)
    env = GymWrapper(gymnasium.make(BIPED, **hurry()), device="cpu")
    env.set_seed(0)
    return env


def test_its_own_check_has_no_complaint():
    from torchrl.envs.utils import check_env_specs

    check_env_specs(made())


def test_time_truncates_and_does_not_terminate():
    rows = made().rollout(40)["next"]
    assert len(rows["done"]) == 15
    assert rows["truncated"][-1]
    assert rows["done"][-1]
    assert not rows["terminated"].any()


def test_its_ppo_learns():
    import torch
    from tensordict.nn import TensorDictModule
    from torch import nn
    from torchrl.envs.utils import ExplorationType, set_exploration_type
    from torchrl.modules import NormalParamExtractor, ProbabilisticActor, TanhNormal, ValueOperator
    from torchrl.objectives import ClipPPOLoss
    from torchrl.objectives.value import GAE

    env = made()
    net = nn.Sequential(
        nn.Linear(6, 16), nn.Tanh(), nn.Linear(16, 2), NormalParamExtractor("biased_softplus_0.3")
    )
    with torch.no_grad():
        net[2].weight.mul_(0.05)
        net[2].bias.zero_()
    actor = ProbabilisticActor(
        TensorDictModule(net, ["observation"], ["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=TanhNormal,
        return_log_prob=True,
        default_interaction_type=ExplorationType.RANDOM,
    )
    inner = nn.Sequential(nn.Linear(6, 16), nn.Tanh(), nn.Linear(16, 1))
    critic = ValueOperator(inner, in_keys=["observation"])
    gains = GAE(gamma=0.9, lmbda=0.95, value_network=critic, average_gae=True)
    loss_of = ClipPPOLoss(actor, critic, entropy_bonus=False)
    adam = torch.optim.Adam(loss_of.parameters(), lr=5e-3)

    def earned() -> float:
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            rows = env.rollout(300, actor, break_when_any_done=False)["next"]
        return float(rows["reward"].sum() / rows["done"].sum())

    before = earned()
    for _ in range(25):
        with torch.no_grad():
            rows = env.rollout(300, actor, break_when_any_done=False)
        for _ in range(6):
            gains(rows)
            loss = loss_of(rows)
            adam.zero_grad()
            (loss["loss_objective"] + loss["loss_critic"]).backward()
            adam.step()
    assert before == pytest.approx(IDLE, abs=0.03)
    assert earned() > LEARNT
