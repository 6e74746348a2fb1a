"""Policy files are data, and a policy is the actor it was made from."""

from __future__ import annotations

import json
import os
import pickle
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.agents import (
    MLPPolicy,
    describe_environment,
    load_policy,
    read_metadata,
    save_policy,
    untrusted,
)
from stickslip.agents.policy.network import FARTHEST
from stickslip.envs import BipedEnv, Randomisation, UGVEnv
from tests.agents.networks import make_policy
from tests.fuzz.spoilt import archive_of, members_of
from tests.trees import assert_same


@pytest.fixture
def path(tmp_path):
    return save_policy(make_policy(), tmp_path / "policy.npz")


@st.composite
def policies(draw: st.DrawFn) -> MLPPolicy:
    inner, last = st.lists(st.integers(1, 6), min_size=1, max_size=3), st.integers(1, 2)
    return make_policy(
        [*draw(inner), draw(last)],
        draw(st.integers(0, 2**32)),
        draw(st.sampled_from([0.0, 1e-30, 1.0, 100.0])),
        activation=draw(st.sampled_from(["tanh", "relu"])),
        squash=draw(st.sampled_from(["tanh", "clip"])),
        observation_clip=draw(st.none() | st.floats(0.5, 1e3)),
    )


@settings(max_examples=40)
@given(policy=policies())
def test_a_policy_of_any_shape_comes_back_to_the_last_bit(policy: MLPPolicy):
    with tempfile.TemporaryDirectory() as folder:
        assert_same(load_policy(save_policy(policy, Path(folder) / "policy.npz")), policy)


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


def test_the_file_says_what_it_is(tmp_path):
    env = BipedEnv(see_friction=True)
    params = env.make_params(randomisation=Randomisation(friction=(0.5, 1.5)))
    about = {"environment": describe_environment(env, params), "note": "größer"}
    found = read_metadata(save_policy(make_policy((8, 4, 1)), tmp_path / "policy.npz", about))
    assert found["layer_sizes"] == [8, 4, 1]
    assert found["note"] == "größer"
    assert found["versions"]["jax"] == jax.__version__
    environment = found["environment"]
    assert environment["observation_size"] == 8
    assert environment["task"]["randomisation"]["friction"] == [0.5, 1.5]
    assert environment["choices"]["see_friction"] is True
    json.dumps(environment, allow_nan=False)


def test_a_policy_keeps_its_history_and_needs_the_inputs_for_it(tmp_path):
    policy = make_policy((3 + 2 * 4, 5, 1), history=2).validate()
    about = {"observation_size": 3}
    assert_same(load_policy(save_policy(policy, tmp_path / "policy.npz", about)), policy)
    with pytest.raises(ValueError, match="observes 3 numbers"):
        save_policy(policy, tmp_path / "other.npz", {"observation_size": 11})
    with pytest.raises(ValueError, match="history = 2 with 12 inputs and 1 outputs; accepted"):
        make_policy((12, 5, 1), history=2).validate()


def test_nothing_is_overwritten_unless_asked(path):
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"policy\.npz exists"):
        save_policy(make_policy((3, 1)), path)
    assert path.read_bytes() == before
    save_policy(make_policy((3, 1)), path, overwrite=True)
    assert load_policy(path).layer_sizes == (3, 1)
    assert list(path.parent.iterdir()) == [path]


def test_metadata_must_be_json_and_must_not_shadow(tmp_path):
    with pytest.raises(ValueError, match="no JSON"):
        save_policy(make_policy(), tmp_path / "a.npz", {"x": float("nan")})
    with pytest.raises(ValueError, match="metadata names version"):
        save_policy(make_policy(), tmp_path / "a.npz", {"version": 3})
    assert not list(tmp_path.iterdir())


class Bomb:
    """Unpickling this would leave a trace."""

    def __reduce__(self):
        return (exec, ("import builtins; builtins.stickslip_bomb = True",))


def rewrite(path, **changes):
    """The same file with some entries replaced, or left out where None."""
    with np.load(path) as file:
        entries = dict(file) | changes
    np.savez(path, **{name: entry for name, entry in entries.items() if entry is not None})


def with_metadata(path, **changes):
    rewrite(path, metadata=np.array(json.dumps(read_metadata(path) | changes)))


def huge_header(path):
    head = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000, 7), }"
    head += b" " * (118 - len(head)) + b"\n"
    raw = b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head
    changed = {"weight_0.npy": raw + b"\x00" * 64}
    path.write_bytes(archive_of(members_of(path.read_bytes()) | changed))


def zip_bomb(path):
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("more.npy", bytes(untrusted.LARGEST))


def sb3_zip(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", "{}")
        archive.writestr("policy.pth", pickle.dumps(Bomb()))


def many_entries(path):
    with zipfile.ZipFile(path, "a") as archive:
        for index in range(3000):
            archive.writestr(f"{index}.npy", b"")


MANY_LISTS = "[" + "[]," * 2 * 10**5 + "[[]]]"
SPOILT = {
    "pickle inside": (
        lambda path: rewrite(path, weight_0=np.array([Bomb()], dtype=object)),
        "archive is damaged .ValueError: Object arrays",
    ),
    "pickle alone": (lambda path: path.write_bytes(pickle.dumps(Bomb())), "archive is damaged"),
    "from SB3": (sb3_zip, "its entry 'data' is no array"),
    "huge array": (huge_header, "archive is damaged"),
    "zip bomb": (zip_bomb, "unpacks to more"),
    "bad JSON": (lambda path: rewrite(path, metadata=np.array("{")), "no JSON"),
    "newer version": (lambda path: with_metadata(path, version=2), "version is 2"),
    "sizes": (lambda path: with_metadata(path, layer_sizes=[7, 5, 3, 1]), "it says"),
    "another task": (lambda path: with_metadata(path, observation_size=8), "observes 7 .*gives 8"),
    "NaN": (lambda path: rewrite(path, bias_2=np.full(1, np.nan, np.float32)), "bias_2.*finite"),
    "huge clip": (lambda path: with_metadata(path, observation_clip=10**400), "observation_clip"),
    "many lists": (lambda path: rewrite(path, metadata=np.array(MANY_LISTS)), "not say"),
    "many entries": (many_entries, "more than 1024 entries"),
    "an entry less": (lambda path: rewrite(path, bias_2=None), "its entries are"),
}


@pytest.mark.parametrize("case", SPOILT)
def test_a_file_that_is_no_policy_is_named_and_nothing_in_it_runs(path, case):
    import builtins

    spoil, words = SPOILT[case]
    spoil(path)
    with pytest.raises(ValueError, match=f"policy.npz: .*{words}.*; accepted: .*save_policy"):
        load_policy(path)
    assert not hasattr(builtins, "stickslip_bomb")


def test_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.npz")
    with pytest.raises(ValueError, match=r"pipe\.npz: cannot be read \(not a plain file\)"):
        load_policy(tmp_path / "pipe.npz")


def test_what_could_not_be_loaded_is_not_written(tmp_path):
    policy = make_policy()
    for bad, words in (
        (replace(policy, biases=tuple(bias.astype(jnp.float16) for bias in policy.biases)), "f2"),
        (replace(policy, scale=policy.scale * 0 + 1e-45), "scale"),
    ):
        with pytest.raises(ValueError, match=words):
            save_policy(bad, tmp_path / "policy.npz")
    assert not list(tmp_path.iterdir())


def test_a_policy_that_loads_cannot_overflow(tmp_path):
    """Whatever the observation within the promised range, from one number a layer on."""
    policy = make_policy(activation="relu")
    big = replace(policy, weights=tuple(weight * 1e8 for weight in policy.weights))
    back = load_policy(save_policy(big, tmp_path / "policy.npz"))
    obs = FARTHEST * jnp.sign(jax.random.normal(jax.random.key(0), (200, 7)))
    assert np.all(np.isfinite(back(obs)))
    with pytest.raises(ValueError, match=r"weight \d lets its layer reach"):
        replace(policy, weights=tuple(weight * 1e12 for weight in policy.weights)).validate()


def test_another_observation_is_refused():
    with pytest.raises(ValueError, match=r"shape \(9,\).*7 entries"):
        make_policy()(jnp.zeros(9))


def test_it_acts_in_the_observations_precision(dtype):
    _, action = make_policy().act(None, jnp.zeros(7, dtype), None, None)
    assert action.shape == (1,)
    assert action.dtype == dtype


def test_a_double_file_keeps_its_digits_until_double_precision_is_switched_on(tmp_path):
    with jax.enable_x64(True):
        policy = jax.tree.map(lambda leaf: jnp.asarray(leaf, float) / 3, make_policy())
        path = save_policy(policy, tmp_path / "policy.npz")
        obs = jnp.linspace(-1.0, 1.0, 7)
        expected = np.asarray(policy(obs))
    early = load_policy(path)
    assert early(np.linspace(-1.0, 1.0, 7)).dtype == jnp.float32
    with jax.enable_x64(True):
        np.testing.assert_array_equal(early(obs), expected)


def test_the_description_of_an_environment_that_it_does_not_fit_is_refused(tmp_path: Path):
    policy, env = load_policy("biped-ice"), UGVEnv()
    other = describe_environment(env, env.make_params())
    with pytest.raises(ValueError, match=r"observes 6 numbers, .*'UGVEnv'\) gives 16; accepted"):
        save_policy(policy, tmp_path / "policy.npz", other)
    assert not list(tmp_path.iterdir())
