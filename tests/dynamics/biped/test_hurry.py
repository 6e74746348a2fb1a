"""A robot is prepared by a program that compiles in a hurry, where nothing is traced."""

import jax
import numpy as np

from stickslip.dynamics import once
from stickslip.dynamics.biped import BipedParams, prepare


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
    fine = jax.tree.leaves(prepare(robot, fidelity="table"))  # what else compiles is compiled
    jax.clear_caches()
    alone = options_asked(monkeypatch, lambda: prepare(robot, fidelity="table"))
    assert once.IN_A_HURRY in alone
    inside = options_asked(
        monkeypatch, lambda: jax.jit(lambda robot: prepare(robot, fidelity="table"))(robot)
    )
    assert once.IN_A_HURRY not in inside
    again = jax.tree.leaves(jax.jit(lambda robot: prepare(robot, fidelity="table"))(robot))
    for one, other in zip(fine, again, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-6)
