"""Policies of other programs: from Stable-Baselines3 (extra `sb3`), and as ONNX (extra `onnx`)."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np
from gymnasium.wrappers import NormalizeObservation

from stickslip.agents.policy.network import MLPPolicy
from stickslip.dynamics.checks import require_kind
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from onnx import ModelProto, NodeProto
    from stable_baselines3.common.base_class import BaseAlgorithm

    from stickslip.agents.untrusted import Json

ACCEPTED = "accepted: PPO or SAC with an MlpPolicy of tanh or relu layers, without use_sde"
OPSET, IR_VERSION = 17, 8
"""ONNX versions of 2022, which every runtime since reads."""
INPUT, OUTPUT, BATCH = "observation", "action", "batch"


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
            weights.append(_array(layer.weight.T))
            biases.append(_array(layer.bias))
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
        raise ValueError(f"it is a {type(model).__name__} of {type(model).__module__}; {ACCEPTED}")
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


def _array(tensor: Any):
    return jnp.asarray(tensor.detach().cpu().numpy())


def export_onnx(
    policy: MLPPolicy,
    path: str | Path,
    metadata: Mapping[str, Json] | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a policy as ONNX and return the path. Needs the extra `onnx`.

    The model takes "observation" [batch, entries], as the environment or FrameStack gives it, and
    returns "action" [batch, entries] in [-1, 1], both in the weights' type. metadata: JSON values,
    `read_metadata(name)` for instance. ValueError for a path that exists and is not to be replaced.
    """
    return write_whole(path, as_onnx(policy, metadata).SerializeToString(), overwrite=overwrite)


def as_onnx(policy: MLPPolicy, metadata: Mapping[str, Json] | None = None) -> ModelProto:
    """The model, checked."""
    import onnx
    from onnx import helper, numpy_helper

    policy.validate()
    dtype = np.asarray(policy.weights[0]).dtype
    kind = helper.np_dtype_to_tensor_dtype(dtype)
    sizes = {INPUT: policy.layer_sizes[0], OUTPUT: policy.layer_sizes[-1]}
    ends = [helper.make_tensor_value_info(name, kind, [BATCH, sizes[name]]) for name in sizes]
    nodes, numbers = _graph(policy)
    held = [numpy_helper.from_array(np.asarray(one, dtype), name) for name, one in numbers.items()]
    model = helper.make_model(
        helper.make_graph(nodes, "policy", ends[:1], ends[1:], held),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="stickslip",
    )
    about = {name: json.dumps(value) for name, value in (metadata or {}).items()}
    helper.set_model_props(model, about)
    onnx.checker.check_model(model)
    return model


def _graph(policy: MLPPolicy) -> tuple[list[NodeProto], dict[str, Any]]:
    """Nodes of the graph in order, and the numbers that they take by name."""
    from onnx import helper

    nodes: list[NodeProto] = []
    numbers: dict[str, Any] = {}

    def then(kind: str, now: str, result: str, **given: Any) -> str:
        nodes.append(helper.make_node(kind, [now, *given], [result]))
        numbers.update(given)
        return result

    now = then("Sub", INPUT, "moved", shift=policy.shift)
    now = then("Div", now, "scaled", scale=policy.scale)
    if (most := policy.observation_clip) is not None:
        now = then("Clip", now, "limited", nearest=-most, farthest=most)
    activation = {"tanh": "Tanh", "relu": "Relu"}[policy.activation]
    for index, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        now = now if index == 0 else then(activation, now, f"hidden_{index - 1}")
        own = {f"weight_{index}": weight, f"bias_{index}": bias}
        now = then("Gemm", now, f"sum_{index}", **own)
    limits = {"least": -1.0, "most": 1.0} if policy.squash == "clip" else {}
    then("Clip" if limits else "Tanh", now, OUTPUT, **limits)
    return nodes, numbers
