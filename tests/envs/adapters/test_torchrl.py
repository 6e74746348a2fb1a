"""TorchRL over the Gymnasium ids: its checks, how episodes end, and a short training."""

from __future__ import annotations

import importlib.util

import gymnasium
import pytest

import stickslip  # noqa: F401  (registers the environments)
from tests.envs.adapters.tiny import BIPED, hurry

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
