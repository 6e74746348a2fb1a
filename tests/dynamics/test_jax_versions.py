"""Kernels with a JAX that nobody has tried: used where they do, done without where they do not."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.extend.core import Primitive
from jax.interpreters import batching, mlir
from jax.interpreters.partial_eval import dce_rules

from stickslip.dynamics import fused as fused_module
from stickslip.dynamics import jax_versions
from stickslip.dynamics.fused import fused, kernel_p
from stickslip.dynamics.jax_versions import changing, register, unclosed, works


def apart(x, y):
    return jnp.sin(x), jnp.exp(y)


def program(size=70):
    """(Lowered, results) of a new fused function of which one result is not read."""
    function = fused(lambda x, y: apart(x, y))
    x = jnp.linspace(0.0, 1.0, size)
    compiled = jax.jit(lambda x: jax.vmap(function)(x, 2 * x)[0])
    return compiled.lower(x).as_text(), compiled(x), np.sin(x)


def test_what_a_scan_changes_is_told_by_shapes():
    def loop(fixed, large, carry, rows):
        def body(carry, row):
            return (carry[0] * fixed + large.sum(), carry[1] + 1), row.sum()

        return jax.lax.scan(body, carry, rows)

    carry = jnp.ones(5), jnp.int32(0)
    traced = jax.make_jaxpr(loop)(jnp.float32(2.0), jnp.ones((4, 6)), carry, jnp.ones((3, 7)))
    (scan,) = [one for one in unclosed(traced).eqns if one.primitive.name == "scan"]
    found = changing(scan, unclosed(scan.params["jaxpr"]))
    assert [one.aval.shape for one in found] == [(5,), (), (7,)]


def test_a_newer_jax_in_which_kernels_do_has_them(untried):
    text, found, wanted = program()
    assert "xla_cpu_small_call" in text
    assert "exponential" not in text
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_where_results_cannot_be_left_out_all_are_computed(untried, monkeypatch):
    def refuses(read, live, forms, equation):
        raise AssertionError("called with another form")

    monkeypatch.setitem(dce_rules, kernel_p, refuses)
    text, found, wanted = program()
    assert "xla_cpu_small_call" in text
    assert "exponential" in text
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def _raises(leaves, axes, **params):
    raise TypeError("vmap's rules have another form")


def _mixes_members_up(leaves, axes, **params):
    return fused_module._batched([leaf[::-1] for leaf in leaves], axes, **params)


@pytest.mark.parametrize(
    ("rule", "reason"),
    [(_raises, "another form"), (_mixes_members_up, "other numbers")],
)
def test_where_kernels_do_not_work_the_function_is_xlas(untried, monkeypatch, rule, reason):
    monkeypatch.setitem(dce_rules, kernel_p, dce_rules[kernel_p])  # given back afterwards
    batching.primitive_batchers[kernel_p] = rule
    try:
        with pytest.warns(RuntimeWarning, match=f"without kernels.*{reason}"):
            text, found, wanted = program()
    finally:
        batching.primitive_batchers[kernel_p] = fused_module._batched
    assert "xla_cpu_small_call" not in text
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_a_jax_without_the_interface_leaves_operations_out(monkeypatch):
    monkeypatch.setattr(jax_versions, "_unregistered", {})
    monkeypatch.delattr(mlir, "register_lowering")
    nobodys = Primitive("nobodys")
    register(nobodys, _raises, list, list)
    with pytest.warns(RuntimeWarning, match="register_lowering"):
        assert not works(nobodys, fused)
    assert works(kernel_p, fused)
