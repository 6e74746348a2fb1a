"""Policies without JAX: in onnxruntime they act as they do in JAX."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import MLPPolicy, export_onnx, load_policy, read_metadata, shipped_names
from stickslip.cli import OK, main
from tests.agents.networks import make_policy
from tests.asked import prints, refusal


def observations(policy: MLPPolicy, count: int = 64) -> np.ndarray:
    """About those that the policy was trained on, and some far from them."""
    draw = np.random.default_rng(1).normal(size=(count, policy.layer_sizes[0]))
    draw[::8] *= 20
    return np.float32(np.asarray(policy.shift) + draw * np.asarray(policy.scale))


def assert_alike(found: np.ndarray, policy: MLPPolicy, obs: np.ndarray) -> None:
    """As the policy acts in JAX, up to rounding."""
    np.testing.assert_allclose(found, policy(obs), atol=2e-5)


def run(path: Path, obs: np.ndarray) -> np.ndarray:
    onnxruntime = pytest.importorskip("onnxruntime")
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    (action,) = session.run(["action"], {"observation": obs})
    return action


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize(
    ("squash", "clip", "layers"), [("clip", 5.0, 3), ("tanh", None, 2), ("clip", None, 1)]
)
def test_every_kind_of_policy_acts_alike(tmp_path, activation, squash, clip, layers):
    sizes, kind = [6, *[16] * (layers - 1), 1], {"activation": activation, "squash": squash}
    policy = make_policy(sizes, factor=0.3, observation_clip=clip, **kind)
    obs = observations(policy)
    assert np.ptp(policy(obs)) > 0.5
    assert_alike(run(export_onnx(policy, tmp_path / "policy.onnx"), obs), policy, obs)


def test_policies_of_the_package_act_alike(tmp_path):
    for name in shipped_names():
        policy = load_policy(name)
        obs = observations(policy)
        assert_alike(run(export_onnx(policy, tmp_path / f"{name}.onnx"), obs), policy, obs)


def test_the_command_writes_what_carries_the_task(tmp_path, capsys):
    onnx = pytest.importorskip("onnx")
    path = tmp_path / "ice.onnx"
    assert "6 numbers in, 1 out" in prints(capsys, "export", "biped-ice", "--out", str(path))
    about = {one.key: json.loads(one.value) for one in onnx.load(path).metadata_props}
    assert about["named_task"] == read_metadata("biped-ice")["named_task"]
    for arguments, said in (
        (["biped-ice", "--out", str(path)], "exists"),
        (["biped-ice", "--out", str(tmp_path / "ice.pt")], "accepted: .onnx"),
        (["biped-icce", "--out", str(path)], "did you mean biped-ice"),
    ):
        assert said in refusal(capsys, "export", *arguments)
    assert main(["export", "biped-ice", "--out", str(path), "--overwrite"]) == OK


def test_plain_numpy_as_the_page_shows_it():
    """What docs/training.md prints, on the file alone."""
    page = (Path(__file__).parents[3] / "docs" / "training.md").read_text(encoding="utf-8")
    code = page.partition("<!-- numpy -->\n\n")[2].partition("\n\n<!-- end of numpy -->")[0]
    spaces: dict = {}
    exec(code.removeprefix("```python\n").removesuffix("```"), spaces)
    policy = load_policy("biped-ice")
    for obs in observations(policy, 8):
        assert_alike(spaces["act"](obs), policy, obs)
