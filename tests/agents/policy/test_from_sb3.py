"""A model of Stable-Baselines3 gives the policy that it is, with its normalisation."""

import gymnasium
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import from_sb3
from tests.extras import SB3


class Box(gymnasium.Env):
    """Seven numbers in, one out; nothing happens."""

    observation_space = gymnasium.spaces.Box(-20, 20, (7,), np.float32)
    action_space = gymnasium.spaces.Box(-1, 1, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.np_random.normal(size=7).astype(np.float32), {}

    def step(self, action):
        return self.np_random.normal(size=7).astype(np.float32), 0.0, False, False, {}


def sb3_model(kind, env=None, **options):
    import stable_baselines3
    import torch

    kind = getattr(stable_baselines3, kind)
    model = kind("MlpPolicy", env or Box(), device="cpu", seed=0, **options)
    generator = torch.Generator().manual_seed(0)
    with torch.no_grad():
        for tensor in model.policy.parameters():  # biases too; SB3's are zero at first
            tensor.add_(0.3 * torch.randn(tensor.shape, generator=generator))
    return model


@SB3
@pytest.mark.parametrize(("kind", "sizes"), [("PPO", [16, 8]), ("PPO", []), ("SAC", [4])])
def test_an_sb3_actor_gives_the_same_actions(kind, sizes):
    model = sb3_model(kind, policy_kwargs={"net_arch": sizes})
    policy = from_sb3(model)
    obs = np.float32(np.random.default_rng(0).normal(size=(50, 7)) * 2)
    expected, _ = model.predict(obs, deterministic=True)
    np.testing.assert_allclose(policy(jnp.asarray(obs)), expected, atol=1e-5)
    assert np.ptp(expected) > 0.1


@SB3
def test_sb3_normalisation_comes_along():
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    env = VecNormalize(DummyVecEnv([Box]), clip_obs=2.0)
    env.obs_rms.mean, env.obs_rms.var = np.linspace(-1, 1, 7), np.linspace(0.2, 4.0, 7)
    model = sb3_model("PPO", env)
    obs = np.float32(np.random.default_rng(0).normal(size=(50, 7)) * 4)
    expected, _ = model.predict(env.normalize_obs(obs), deterministic=True)
    np.testing.assert_allclose(from_sb3(model)(jnp.asarray(obs)), expected, atol=1e-5)


@SB3
def test_observations_normalised_elsewhere_are_not_passed_over(tmp_path):
    from gymnasium.wrappers import NormalizeObservation
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import DummyVecEnv

    model = sb3_model("PPO", DummyVecEnv([lambda: NormalizeObservation(Box())]))
    with pytest.raises(ValueError, match=r"NormalizeObservation.*accepted: .*VecNormalize"):
        from_sb3(model)
    sb3_model("PPO").save(tmp_path / "model.zip")
    with pytest.warns(RuntimeWarning, match="no environment"):
        from_sb3(PPO.load(tmp_path / "model.zip", device="cpu"))
    with pytest.raises(ValueError, match="model = 'x'; accepted: a PPO or SAC model"):
        from_sb3("x")  # type: ignore[arg-type]


@SB3
def test_other_sb3_models_are_refused():
    from torch import nn

    for model, words in (
        (sb3_model("A2C"), "A2C"),
        (sb3_model("SAC", use_sde=True), "layer"),
        (sb3_model("PPO", policy_kwargs={"activation_fn": nn.ELU}), "ELU"),
    ):
        with pytest.raises(ValueError, match=f"(?s){words}.*accepted: PPO or SAC"):
            from_sb3(model)
