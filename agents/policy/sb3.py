"""The actor of a Stable-Baselines3 model as an MLPPolicy. Needs the extra `sb3`."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np
from gymnasium.wrappers import NormalizeObservation

from stickslip.agents.policy.network import MLPPolicy
from stickslip.dynamics.checks import require_kind

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm

ACCEPTED = "accepted: PPO or SAC with an MlpPolicy of tanh or relu layers, without use_sde"


def from_sb3(model: BaseAlgorithm) -> MLPPolicy:
    """The deterministic actor of a PPO or SAC model, observation normalisation included.

    Equals model.predict(obs, deterministic=True); if the model's environment is wrapped in
    VecNormalize with norm_obs, its present mean and variance become shift and scale, and the policy
    takes the raw observations. A model without an environment, as one that was loaded without
    `env=`, does not know how its observations were normalised: RuntimeWarning. Raises ValueError
    for any other algorithm or network, and for environments in Gymnasium's NormalizeObservation,
    whose numbers are each environment's own.
    """
    from stable_baselines3.common.base_class import BaseAlgorithm
    from torch import nn

    require_kind("model", model, BaseAlgorithm, "a PPO or SAC model of Stable-Baselines3")
    squash, layers = _actor(model)
    weights, biases, activations = [], [], []
    for layer in layers:
        if isinstance(layer, nn.Linear):
            weights.append(_numbers(layer.weight.T))
            biases.append(_numbers(layer.bias))
        elif isinstance(layer, nn.Tanh | nn.ReLU):
            activations.append("tanh" if isinstance(layer, nn.Tanh) else "relu")
        else:
            raise ValueError(f"its actor has a layer {layer}; {ACCEPTED}")
    if len(set(activations)) > 1 or len(activations) != len(weights) - 1:
        raise ValueError(f"its actor's activations are {activations}; {ACCEPTED}")
    shift, scale, clip = _normalisation(model, weights[0].shape[0])
    return MLPPolicy(
        weights=tuple(weights),
        biases=tuple(biases),
        shift=shift,
        scale=scale,
        activation=activations[0] if activations else "tanh",
        squash=squash,
        observation_clip=clip,
    ).validate()


def _actor(model: BaseAlgorithm) -> tuple[str, list[Any]]:
    """Squashing of the output, and the layers in order."""
    from stable_baselines3 import PPO, SAC
    from stable_baselines3.common.torch_layers import FlattenExtractor

    space = model.action_space
    low, high = getattr(space, "low", None), getattr(space, "high", None)
    if len(space.shape or ()) != 1 or not (np.all(low == -1) and np.all(high == 1)):
        raise ValueError(f"its action space is {space}; accepted: Box(-1, 1, (n,))")
    policy: Any = model.policy
    if isinstance(model, PPO) and not policy.squash_output:
        extractor, squash = policy.features_extractor, "clip"
        layers = [*policy.mlp_extractor.policy_net, policy.action_net]
    elif isinstance(model, SAC):
        extractor, squash = policy.actor.features_extractor, "tanh"
        layers = [*policy.actor.latent_pi, policy.actor.mu]
    else:
        raise ValueError(f"it is a {type(model).__name__}; {ACCEPTED}")
    if not isinstance(extractor, FlattenExtractor):
        raise ValueError(f"its features come from a {type(extractor).__name__}; {ACCEPTED}")
    return squash, layers


def _normalisation(model: BaseAlgorithm, size: int):
    """Shift, scale and clip of the observation."""
    envs = model.get_env()
    if envs is None:
        warnings.warn(
            "the model has no environment: it is taken to have been trained on observations that "
            "nothing normalised; if VecNormalize did, load it with env= that",
            RuntimeWarning,
            stacklevel=3,
        )
    elif any(envs.env_is_wrapped(NormalizeObservation)):
        raise ValueError(
            "its environments are wrapped in NormalizeObservation, each with numbers of its own; "
            "accepted: environments in Stable-Baselines3's VecNormalize, or as they are"
        )
    wrapper = model.get_vec_normalize_env()
    if wrapper is None or not wrapper.norm_obs:
        return jnp.zeros(size, jnp.float32), jnp.ones(size, jnp.float32), None
    seen: Any = wrapper.obs_rms
    scale = np.sqrt(seen.var + wrapper.epsilon)
    return jnp.float32(seen.mean), jnp.float32(scale), float(wrapper.clip_obs)


def _numbers(tensor: Any):
    return jnp.asarray(tensor.detach().cpu().numpy())
