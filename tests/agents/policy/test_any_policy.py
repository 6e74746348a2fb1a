"""A policy of any shape comes back from its file to the last bit; no damaged file is a policy."""

from __future__ import annotations

import itertools
import tempfile
from pathlib import Path
from typing import Any

import jax
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.agents import MLPPolicy, load_policy, save_policy


@st.composite
def policies(draw: st.DrawFn) -> MLPPolicy:
    inner, last = st.lists(st.integers(1, 6), min_size=1, max_size=3), st.integers(1, 2)
    sizes = [*draw(inner), draw(last)]
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    size = draw(st.sampled_from([0.0, 1e-30, 1.0, 100.0]))
    return MLPPolicy(
        weights=tuple(
            np.float32(size * random.normal(size=pair)) for pair in itertools.pairwise(sizes)
        ),
        biases=tuple(np.float32(size * random.normal(size=n)) for n in sizes[1:]),
        shift=np.float32(random.normal(size=sizes[0])),
        scale=np.float32(random.uniform(0.01, 100, sizes[0])),
        activation=draw(st.sampled_from(["tanh", "relu"])),
        squash=draw(st.sampled_from(["tanh", "clip"])),
        observation_clip=draw(st.none() | st.floats(0.5, 1e3)),
    )


def assert_same(one: Any, other: Any) -> None:
    assert jax.tree.structure(one) == jax.tree.structure(other)
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        assert np.asarray(a).tobytes() == np.asarray(b).tobytes()


@settings(max_examples=40)
@given(policy=policies())
def test_a_policy_of_any_shape_comes_back_to_the_last_bit(policy: MLPPolicy):
    with tempfile.TemporaryDirectory() as folder:
        path = save_policy(policy, Path(folder) / "policy.npz")
        assert_same(load_policy(path), policy)


@settings(max_examples=40)
@given(policy=policies(), data=st.data())
def test_a_file_cut_or_changed_in_one_byte_is_refused_or_the_same(
    policy: MLPPolicy, data: st.DataObject
):
    with tempfile.TemporaryDirectory() as folder:
        path = save_policy(policy, Path(folder) / "policy.npz")
        whole = path.read_bytes()
        place = data.draw(st.integers(0, len(whole) - 1))
        changed = data.draw(st.none() | st.integers(1, 255))
        rest = b"" if changed is None else bytes([whole[place] ^ changed]) + whole[place + 1 :]
        path.write_bytes(whole[:place] + rest)
        found, said = None, ""
        try:
            found = load_policy(path)
        except ValueError as error:
            said = str(error)
    assert (found is None) == ("policy.npz" in said)
    if found is not None:
        assert_same(found, policy)
        assert changed is not None, "a file without its end was read"
