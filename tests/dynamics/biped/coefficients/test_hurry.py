"""A robot is prepared by a program that compiles in a hurry, where nothing is traced."""

from functools import partial

import jax
import numpy as np

from stickslip.dynamics import once
from stickslip.dynamics.biped import BipedParams, Table, prepare


def options_asked(monkeypatch, call):
    """Options with which programs are compiled during a call."""
    from jax._src import compiler

    asked, plain = [], compiler.get_compile_options

    def listening(*args, env_options_overrides=None, **kwargs):
        asked.append(env_options_overrides or {})
        return plain(*args, env_options_overrides=env_options_overrides, **kwargs)

    monkeypatch.setattr(compiler, "get_compile_options", listening)
    call()
    return [dict(options) for options in asked]


def test_a_robot_is_prepared_in_a_hurry_outside_of_a_trace_alone(monkeypatch):
    robot = BipedParams.from_bars()
    prepared = partial(prepare, fidelity=Table(5, 3))  # that nothing else compiles
    asked = options_asked(monkeypatch, lambda: prepared(robot))
    hurried = once.known(once.IN_A_HURRY)  # XLA has said now what it does not know
    assert hurried
    assert hurried in asked
    traced = jax.jit(prepared)
    assert hurried not in options_asked(monkeypatch, lambda: traced(robot))
    both = jax.tree.leaves(prepared(robot)), jax.tree.leaves(traced(robot))
    for one, other in zip(*both, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-6)
