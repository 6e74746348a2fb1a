"""Derivatives of the event-exact walk: its end and the instants of its switches.

The reference is a central difference of fourth order of the walk itself.
"""

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import EventExact, RK4Split, step
from tests.dynamics.biped.helpers import state_of
from tests.dynamics.biped.stepping import derivatives as gradients
from tests.dynamics.biped.stepping.derivatives import CASES, INPUTS, OUTPUTS

pytestmark = pytest.mark.long

SPEC = EventExact(record_events=True)
SWITCHES = {
    "slides off, stops": 2,
    "breaks loose, stops": 2,
    "stops, slides, exchanges": 3,
    "onto ice": 2,
}
"""How many each walk has."""


@lru_cache
def given(case: str) -> tuple[jax.Array, ...]:
    inputs, *start = CASES[case]
    return jnp.asarray(inputs), *map(jnp.asarray, start)


@lru_cache
def weights() -> np.ndarray:
    return np.random.default_rng(3).normal(size=len(OUTPUTS) + gradients.SWITCHES)


def derived(*start: jax.Array) -> gradients.Derivatives:
    return jax.tree.map(np.asarray, gradients.derivatives(SPEC, jnp.asarray(weights()), *start))


@lru_cache
def of(case: str) -> gradients.Derivatives:
    return derived(*given(case))


@pytest.mark.parametrize("case", CASES)
def test_end_and_instants_have_the_derivatives_that_differences_show(float64, case):
    assert of(case).switches == SWITCHES[case]
    want = gradients.differences(SPEC, *given(case))
    assert np.any(want[len(OUTPUTS) + SWITCHES[case] - 1])  # the last switch's instant moves
    # measured: 6e-9 at the default tolerance of 1e-9
    assert gradients.worst(of(case).forward, want).max() < 1e-7


@pytest.mark.parametrize("case", CASES)
def test_reverse_derivatives_are_the_forward_ones(float64, case):
    want = weights() @ of(case).forward
    assert np.abs(of(case).weighted - want).max() < 1e-12 * np.abs(want).max()


def test_split_steps_of_fixed_length_have_the_same_derivatives_to_their_order(float64):
    """Of the walk's end and of its instants; measured: 2e-5 with 40 steps, 1e-7 with 160."""
    case = "stops, slides, exchanges"
    spec = RK4Split(substeps=40, max_events=8, record_events=True)
    found = gradients.derivatives(spec, jnp.asarray(weights()), *given(case))
    assert gradients.worst(np.asarray(found.forward), of(case).forward).max() < 1e-4
    want = weights() @ np.asarray(found.forward)
    assert np.abs(np.asarray(found.weighted) - want).max() < 1e-12 * np.abs(want).max()


def test_the_edge_moves_only_walks_that_reach_it_and_not_before(float64):
    edge, onset = INPUTS.index("edge"), len(OUTPUTS)
    assert not np.any(of("breaks loose, stops").forward[:, edge])
    slopes = of("onto ice").forward
    assert slopes[onset, edge] == 0
    assert slopes[onset + 1, edge] > 0  # a farther edge is reached later
    assert np.all(slopes[: len(OUTPUTS), edge] != 0)


def near_peak(ratio: float, below: float) -> gradients.Derivatives:
    """The walk that barely breaks loose; ratio: mu kinetic / mu static."""
    (torque, rate, *_), phase, velocity, duration = CASES["breaks loose, stops"]
    static = peak() * (1 - below)
    inputs = jnp.asarray([torque, rate, static, ratio * static, gradients.NOWHERE])
    return derived(inputs, *map(jnp.asarray, (phase, velocity, duration)))


@lru_cache
def peak() -> float:
    (_, rate, *_), phase, *_ = CASES["breaks loose, stops"]
    return float(gradients.peak_use(rate, phase))


def test_the_instant_of_a_grazing_onset_has_the_slope_of_a_square_root(float64):
    by, onset = INPUTS.index("mu static"), len(OUTPUTS)
    steep = [near_peak(0.8, below).forward[onset, by] * below**0.5 for below in (1e-3, 1e-4)]
    assert steep[0] == pytest.approx(steep[1], rel=0.01)


@jax.jit
def unsplit(static: jax.Array, size: jax.Array, count: jax.Array) -> tuple[jax.Array, jax.Array]:
    """End of "breaks loose, stops" by steps that switch at their ends, and its derivative."""
    (torque, rate, _, kinetic, _), phase, *_ = CASES["breaks loose, stops"]
    begin = state_of(phase=phase, crank_rate=rate)

    def crank_angle(static):
        scene = Scene.uniform(static, jnp.asarray(kinetic), outputs="state")

        def body(_, now):
            model = gradients.default_model()
            return step(model, scene, now, jnp.asarray(torque), size, integrator="rk4")[0]

        return jax.lax.fori_loop(0, count, body, begin).crank_angle

    return jax.jvp(crank_angle, (static,), (jnp.ones_like(static),))


def test_unsplit_derivatives_miss_the_instants_at_any_time_step(float64):
    """By mu static they are 0, for it only says when; by differences the walk moves all right."""
    slopes = of("breaks loose, stops").forward
    want = slopes[OUTPUTS.index("crank angle"), INPUTS.index("mu static")]
    (*_, static, _, _), _, _, duration = CASES["breaks loose, stops"]
    for count in (7000, 28000):
        at = jnp.asarray(duration / count), jnp.asarray(count)
        (above, slope), (below, _) = (unsplit(jnp.asarray(static + h), *at) for h in (3e-3, -3e-3))
        assert slope == 0
        assert (above - below) / 6e-3 == pytest.approx(want, rel=0.1)
