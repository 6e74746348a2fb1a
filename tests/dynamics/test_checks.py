"""One rule for every number that a user gives, and one form of refusal."""

import re
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import checks

NO_NUMBERS = {
    "a word": "1.0",
    "bytes": b"1",
    "nothing": None,
    "a truth": True,
    "truths": np.array([True]),
    "an empty list": [],
    "a ragged list": [[1.0], [1.0, 2.0]],
    "an object": object(),
    "a fraction": Fraction(1, 2),
    "a complex number": 1j,
    "a dictionary": {"a": 1.0},
    "a key": "key",
    "a huge integer": 10**400,
    "not a number": float("nan"),
    "infinite": float("inf"),
    "one of them infinite": [0.0, float("inf")],
    "infinite in float32": 1e39,
    "zero in float32": 1e-45,
    "a long word": "x" * 10**6,
}


@pytest.mark.parametrize("what", NO_NUMBERS)
def test_what_is_no_number_is_refused_by_name_in_a_line(what):
    value = jax.random.key(0) if what == "a key" else NO_NUMBERS[what]
    with pytest.raises(ValueError, match=r"mu = .*accepted: > 0|mu has shape.*accepted") as caught:
        checks.require_number("mu", value, low=0.0, strict=True, accepted="> 0")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    "value",
    [1, 1.0, np.float32(1), np.int8(1), np.uint64(1), [1, 2.0], (1,), 2**40, np.ones((2, 3)), 1e38],
    ids=repr,
)
def test_numbers_of_any_kind_pass_and_become_what_pytrees_hold(value):
    found = checks.as_number("mu", value, low=0.0, accepted=">= 0")
    assert isinstance(found, float | np.floating | np.ndarray | jax.Array)
    assert np.allclose(np.asarray(found), np.asarray(value, float))


def test_precision_decides_what_is_finite(float64):
    checks.require_number("mu", 1e39, accepted="finite")
    with pytest.raises(ValueError, match="out of range in float32"):
        checks.require_number("mu", 1e39, accepted="finite", dtype=jnp.float32)
    with pytest.raises(ValueError, match=r"mu = inf"):
        checks.require_number("mu", np.float32(np.inf), accepted="finite")


def test_traced_values_pass():
    @jax.jit
    def traced(x):
        checks.require_number("x", x, low=10.0, accepted=">= 10")
        return checks.as_number("x", [x, x], low=10.0, accepted=">= 10")

    assert traced(1.0).tolist() == [1.0, 1.0]


def test_names_are_refused_with_the_nearest():
    with pytest.raises(ValueError, match=r"'slip_wieght' is no field.*did you mean slip_weight"):
        checks.require_known(["slip_wieght"], ["slip_weight", "energy_weight"])
    with pytest.raises(ValueError, match=r"scene = 'Slipery'.*did you mean slippery"):
        checks.require_choice("scene", "Slipery", ["slippery", "grip"])
    for value in ([], None, {}, np.zeros(2), "zzz"):
        with pytest.raises(ValueError, match=r"accepted: 'slippery', 'grip'$"):
            checks.require_choice("scene", value, ["slippery", "grip"])


def test_sizes_are_refused_before_there_is_anything(monkeypatch):
    monkeypatch.delenv(checks.MEMORY_LIMIT, raising=False)
    checks.require_memory("spacing = 1", "waypoints", 100, 1e7)
    for count in (1e12, np.inf, np.nan, 10**400):
        with pytest.raises(ValueError, match=rf"spacing = 1.*{checks.MEMORY_LIMIT}"):
            checks.require_memory("spacing = 1", "waypoints", count, 8)
    monkeypatch.setenv(checks.MEMORY_LIMIT, "1e14")
    checks.require_memory("spacing = 1", "waypoints", 1e12, 8)
    for given in ("much", "-1", "nan", ""):
        monkeypatch.setenv(checks.MEMORY_LIMIT, given)
        with pytest.raises(ValueError, match=re.escape(checks.MEMORY_LIMIT)):
            checks.require_memory("spacing = 1", "waypoints", 1, 8)


def test_whole_numbers_are_whole_and_no_truths():
    assert checks.require_integer("n", np.int32(3)) == 3
    for value in (True, 0, 1.0, "1", None, [1], 10**400):
        with pytest.raises(ValueError, match=r"n = .*accepted: an integer >= 1, <= 9"):
            checks.require_integer("n", value, high=9)
