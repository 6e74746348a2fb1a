"""A policy as an ONNX model, normalisation included. Needs the extra `onnx`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.policy.network import PlainPolicy
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from onnx import ModelProto, NodeProto

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.untrusted import Json

OPSET, IR_VERSION = 17, 8
"""Of 2022: read by every runtime since."""
INPUT, OUTPUT, BATCH = "observation", "action", "batch"


def export_onnx(
    policy: MLPPolicy,
    path: str | Path,
    metadata: Mapping[str, Json] | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a policy as ONNX and return the path. Needs the extra `onnx`.

    The model takes "observation" [batch, entries] as the environment gives it and returns "action"
    [batch, entries] in [-1, 1], both in the weights' type. metadata: JSON values that it carries,
    `read_metadata(name)` for instance. ValueError for a path that exists and is not to be replaced.
    """
    raw = as_onnx(policy, metadata).SerializeToString()
    return write_whole(path, raw, overwrite=overwrite)


def as_onnx(policy: MLPPolicy, metadata: Mapping[str, Json] | None = None) -> ModelProto:
    """The model, checked."""
    import onnx
    from onnx import helper, numpy_helper

    plain = PlainPolicy.of(policy)
    kind = helper.np_dtype_to_tensor_dtype(plain.weights[0].dtype)
    sizes = {INPUT: len(plain.shift), OUTPUT: len(plain.biases[-1])}
    ends = [helper.make_tensor_value_info(name, kind, [BATCH, sizes[name]]) for name in sizes]
    numbers = {name: value.astype(plain.weights[0].dtype) for name, value in _numbers(plain)}
    held = [numpy_helper.from_array(value, name) for name, value in numbers.items()]
    graph = helper.make_graph(list(_nodes(plain)), "policy", ends[:1], ends[1:], held)
    model = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="stickslip",
    )
    about = {name: json.dumps(value) for name, value in (metadata or {}).items()}
    helper.set_model_props(model, about)
    onnx.checker.check_model(model)
    return model


def _numbers(plain: PlainPolicy) -> Iterator[tuple[str, np.ndarray]]:
    yield "shift", plain.shift
    yield "scale", plain.scale
    for index, (weight, bias) in enumerate(zip(plain.weights, plain.biases, strict=True)):
        yield f"weight_{index}", weight
        yield f"bias_{index}", bias
    if plain.observation_clip is not None:
        yield "farthest", np.asarray(plain.observation_clip)
        yield "nearest", np.asarray(-plain.observation_clip)
    if plain.squash == "clip":
        yield "most", np.asarray(1.0)
        yield "least", np.asarray(-1.0)


def _nodes(plain: PlainPolicy) -> Iterator[NodeProto]:
    """Nodes of the graph in order."""
    from onnx import helper

    yield helper.make_node("Sub", [INPUT, "shift"], ["moved"])
    yield helper.make_node("Div", ["moved", "scale"], ["scaled"])
    now = "scaled"
    if plain.observation_clip is not None:
        yield helper.make_node("Clip", [now, "nearest", "farthest"], ["limited"])
        now = "limited"
    last = len(plain.weights) - 1
    for index in range(last + 1):
        yield helper.make_node("Gemm", [now, f"weight_{index}", f"bias_{index}"], [f"sum_{index}"])
        now = f"sum_{index}"
        if index < last:
            kind = "Tanh" if plain.activation == "tanh" else "Relu"
            yield helper.make_node(kind, [now], [f"hidden_{index}"])
            now = f"hidden_{index}"
    limits = ["least", "most"] if plain.squash == "clip" else []
    yield helper.make_node("Clip" if limits else "Tanh", [now, *limits], [OUTPUT])
