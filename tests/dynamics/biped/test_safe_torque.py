"""Safe torques: no slip and no fall within the interval, one or the other beyond it."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    BipedState,
    RK4Split,
    forward_dynamics,
    prepare,
    safe_torque,
)
from stickslip.dynamics.biped.contact import Torque
from stickslip.dynamics.biped.simulation import stepped
from stickslip.dynamics.status import Status
from stickslip.envs import BipedEnv
from stickslip.envs.biped.params import Randomisation
from stickslip.envs.functional import pure_step

PERIOD, LONG, LIMIT = 0.02, 0.1, 8.0
"""[s], [s], [N m]"""
MEMBERS, FAST = 4096, 3072
"""Of them so many are fast on ice."""


@pytest.fixture(scope="module")
def walks():
    """Random foot at rest: its safe torque, statuses of walks under torques in and beyond it."""
    with jax.enable_x64(True):
        robot = prepare(BipedParams.from_bars(), fidelity="table")
        rng = np.random.default_rng(0)
        phase = jnp.asarray(rng.uniform(SUPPORT_START, SUPPORT_END, MEMBERS))
        rate = rng.uniform(-10, 10, MEMBERS) * np.where(np.arange(MEMBERS) % 4, 1.0, 0.05)
        mu, share = 10 ** rng.uniform(-2, 0, MEMBERS), rng.integers(0, 3, MEMBERS) / 2
        rate[:FAST] = rng.uniform(6, 12, FAST) * rng.choice([-1, 1], FAST)
        mu[:FAST] = rng.uniform(0.02, 0.05, FAST)

        def one(phase, rate, mu, share, margin, period):
            state = BipedState(phase=phase, crank_rate=rate).astype(jnp.float64)
            how = {"duration": period, "torque_limit": LIMIT}
            safe = safe_torque(robot, state, 0.0, mu, margin, **how)

            def status(torque):
                floor = Scene.uniform(mu, mu)
                how = RK4Split(16), "table", robot, floor, state, Torque(torque), period
                return stepped(*how)[1].status

            within = safe.low + (safe.high - safe.low) * share
            beyond = 0.05 * (jnp.abs(safe.high) + 0.05)
            return safe, status(within), status(safe.high + beyond)

        batch = jax.jit(jax.vmap(one, in_axes=(0, 0, 0, 0, None, None)))
        given = [jnp.asarray(column) for column in (phase, rate, mu, share)]
        pairs = (0.0, PERIOD), (0.02, PERIOD), (0.02, LONG)
        found = {pair: batch(*given, *pair) for pair in pairs}
        return jax.tree.map(np.asarray, found)


@pytest.mark.parametrize(("period", "share"), [(PERIOD, 0.75), (LONG, 0.35)])
def test_the_foot_neither_slips_nor_leaves_the_floor(walks, period, share):
    safe, within, _ = walks[0.02, period]
    some = safe.status == Status.OK
    assert some[FAST:].mean() > share
    assert (within[some] == Status.OK).all()


def test_beyond_the_interval_it_slips_or_falls(walks):
    safe, _, beyond = walks[0.0, PERIOD]
    some = ((safe.status == Status.OK) & (safe.high < LIMIT))[FAST:]
    assert (beyond[FAST:][some] != Status.OK).mean() > 0.8


def test_the_interval_of_an_instant_is_that_of_forward_dynamics():
    robot = prepare(BipedParams.from_bars(dtype=jnp.float32), fidelity="table")
    torques = jnp.linspace(-12.0, 12.0, 2401)

    @jax.jit
    @partial(jax.vmap, in_axes=(None, None, 0))
    def status(phase, rate, torque):
        return forward_dynamics(robot, phase, rate, 0.0, torque, 0.1, 0.1).status

    for phase, rate in ((2.0, 0.0), (2.9, 4.0), (4.2, 6.0)):
        state = BipedState(phase=phase, crank_rate=rate)
        safe = safe_torque(robot, state, 0.0, 0.1, 0.0, duration=1e-5)
        still = np.asarray(torques)[np.asarray(status(phase, rate, torques)) == Status.OK]
        assert abs(float(safe.low) - still.min()) < 0.0101
        assert abs(float(safe.high) - still.max()) < 0.0101


def test_a_torque_within_is_kept_and_one_beyond_is_moved_to_the_end():
    robot = prepare(BipedParams.from_bars(), fidelity="table")
    state = BipedState(phase=2.5, crank_rate=3.0)
    low, high = safe_torque(robot, state, 0.0, 0.06)[1:3]
    middle = float(low + high) / 2
    for asked, given in ((middle, middle), (99.0, float(high)), (-99.0, float(low))):
        assert float(safe_torque(robot, state, asked, 0.06).torque) == pytest.approx(given)


def test_empty_intervals_say_why():
    robot = prepare(BipedParams.from_bars(), fidelity="table")
    sliding = BipedState(phase=2.5, crank_rate=3.0, foot_velocity=0.1)
    assert safe_torque(robot, sliding, 0.5, 0.06).status == Status.SLIP_ONSET
    fast = BipedState(phase=4.71, crank_rate=9.0)  # an exchange within the period
    icy = safe_torque(robot, fast, 0.5, 0.01)
    assert icy.status == Status.SLIP_ONSET
    assert icy.low > icy.high
    weak = safe_torque(robot, BipedState(phase=3.0, crank_rate=25.0), 0.5, 0.5, torque_limit=0.1)
    assert weak.status == Status.TOPPLE
    assert abs(weak.torque) <= np.float32(0.1)
    nothing = safe_torque(robot, BipedState(), np.nan, 0.5)
    assert (nothing.status, nothing.torque) == (Status.NON_FINITE, 0.0)


def test_the_next_foothold_counts_where_it_is_reached():
    robot = prepare(BipedParams.from_bars(), fidelity="table")
    early, late = BipedState(phase=3.0, crank_rate=3.0), BipedState(phase=4.7, crank_rate=3.0)
    for state, counts in ((early, False), (late, True)):
        plain, icy = (safe_torque(robot, state, 9.0, 0.3, mu_next=mu).high for mu in (0.3, 0.03))
        assert (icy < plain) == counts


@pytest.mark.long
def test_derivatives_are_those_of_differences():
    robot = prepare(BipedParams.from_bars(), fidelity="table")

    def high(rate):
        return safe_torque(robot, BipedState(phase=2.5, crank_rate=rate), 9.0, 0.06).torque

    slope = float(jax.grad(high)(3.0))
    assert slope == pytest.approx(float(high(3.05) - high(2.95)) / 0.1, rel=1e-2)


@pytest.mark.parametrize("given", [{"margin": 2.0}, {"mu_static": -1.0}, {"duration": 0}])
def test_bad_numbers_are_refused_by_name(given):
    whole = {"torque": 1.0, "mu_static": 0.1} | given
    with pytest.raises(ValueError, match=f"{next(iter(given))} = "):
        safe_torque(BipedParams.from_bars(), BipedState(), **whole)


@pytest.mark.long
def test_behind_the_shield_no_episode_slides_whose_interval_is_never_empty():
    env = BipedEnv(autoreset="disabled", shield=0.02)
    starts = {"phase": (SUPPORT_START, SUPPORT_END), "crank_rate": (-3.0, 8.0)}
    drawn = Randomisation(friction=(0.2, 4.0), payload=(0.0, 2.0), **starts)
    params = env.make_params(scene=Scene.uniform(0.05, 0.04), randomisation=drawn)

    @jax.jit
    @jax.vmap
    def episode(key):
        start, *keys = jax.random.split(key, 101)
        _, state = env.reset(start, params)

        def body(carry, key):
            state, over, empty, slid = carry
            torque = jax.random.uniform(key, (1,), minval=-1.0)
            _, after, _, ended, late, info = pure_step(env, key, state, torque, params)
            empty |= ~over & (info["shield"] != Status.OK)
            slid += jnp.where(over, 0.0, info["slid"])
            return (after, over | ended | late, empty, slid), None

        none = jnp.zeros((), bool)
        begin = state, none, none, jnp.zeros(())
        _, ended, empty, slid = jax.lax.scan(body, begin, jnp.stack(keys))[0]
        return ended, empty, slid

    ended, empty, slid = map(np.asarray, episode(jax.random.split(jax.random.key(0), 2048)))
    assert (~empty).mean() > 0.3
    assert slid[~empty].max() == 0.0
    assert not ended[~empty].any()
    assert (slid[empty] > 0).any()
