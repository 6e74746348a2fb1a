"""A scene does not pay for what it leaves out: sizes and contents of the compiled programs."""

import os
import re
from collections import Counter
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, prepare, simulate
from stickslip.dynamics.kernels.grouping import SWITCH

INSTRUCTION = re.compile(r"^\s+(?:ROOT )?%?[\w.\-]+ = [^=]*? ([a-z][a-z0-9\-]*)\(", re.MULTILINE)
BOOKKEEPING = {
    *("parameter", "constant", "tuple", "get-tuple-element", "bitcast", "bitcast-convert"),
    *("broadcast", "call", "conditional", "copy", "fusion", "reshape", "slice", "while"),
}
"""Instructions that compute nothing."""
SCENES = {"grip": Scene.grip(), "uniform": Scene.uniform(0.06, 0.05)}
SCENES |= {"patches": Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5])}
NUMBERS = {"uniform": {"mu_static", "mu_kinetic"}, "patches": {"edges", "mu_static", "mu_kinetic"}}
NUMBERS |= {"grip": set()}
"""The floors' numbers, which the program names among its inputs."""

each_program = pytest.mark.parametrize("name", SCENES)


@lru_cache
def programs():
    """200 steps of 10 ms of a proportional controller, float32, by plain XLA; by scene."""
    params = BipedParams.from_bars(heel=1e3, toe=1e3, dtype=jnp.float32)  # topples never
    zero = jnp.zeros((), jnp.float32)
    state = BipedState(zero + 2.5, jnp.zeros((), jnp.int32), zero + 3.0, zero, zero, zero)

    def walk(model, scene, state):
        return simulate(model, scene, state, lambda now: 4.0 - now.crank_rate, 2.0, 0.01)

    model, found = jax.jit(partial(prepare, fidelity="table"))(params), {}
    with pytest.MonkeyPatch.context() as patch:
        jax.clear_caches()
        patch.setitem(os.environ, SWITCH, "off")
        for name, scene in SCENES.items():
            scene = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), scene)
            lowered = jax.jit(walk).lower(model, scene, state)
            # as users have it: `make test` keeps loops as they are traced
            found[name] = lowered.compile(compiler_options={"xla_disable_hlo_passes": ""})
    jax.clear_caches()
    return found


@lru_cache
def kinds(name: str) -> Counter[str]:
    """Instructions of the optimised program by kind; a loop's body counts once."""
    return Counter(INSTRUCTION.findall(programs()[name].as_text()))


def size(name: str) -> int:
    return sum(count for kind, count in kinds(name).items() if kind not in BOOKKEEPING)


@each_program
def test_a_program_reads_the_numbers_of_its_floor_and_no_other(name):
    text = programs()[name].as_text()
    found = {word for word in set.union(*NUMBERS.values()) if f"floor.{word}" in text}
    assert found == NUMBERS[name]


@each_program
def test_no_program_solves_the_full_system_for_what_two_equations_say(name):
    assert not kinds(name).keys() & {"custom-call", "triangular-solve", "cholesky"}


def test_grip_takes_less_than_two_thirds_of_the_operations_of_a_floor_that_slips():
    assert size("grip") < 0.667 * size("uniform")
    assert size("grip") < 0.6 * size("patches")
    flops = [programs()[name].cost_analysis()["flops"] for name in ("grip", "uniform")]
    assert flops[0] < 0.667 * flops[1]


def test_edges_cost_only_where_there_are_edges():
    assert size("uniform") < size("patches")
