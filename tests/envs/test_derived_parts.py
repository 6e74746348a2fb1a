"""What is prepared from parameters follows every change of them, however the change is made."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, prepare
from stickslip.dynamics.biped.model import load
from stickslip.dynamics.ugv import UGVParams
from stickslip.envs import BipedEnv, Randomisation, UGVEnv
from stickslip.envs.biped.state import drawn_robot
from stickslip.envs.ugv.randomisation import UGVRandomisation
from tests.envs.helpers import task
from tests.trees import assert_same

OWN = 8.4661588
"""Mass of the default robot [kg]."""
LOADED = Scene.uniform(0.06, 0.05, payload=2.0)
BARE = Scene.uniform(0.06, 0.05)


same = partial(assert_same, rtol=1e-6, atol=1e-6)
WAYS = {"method": lambda tree, **new: tree.replace(**new), "dataclasses": replace}


@pytest.mark.parametrize("way", WAYS)
def test_a_payload_is_carried_however_it_came(way):
    env, params = task()
    after = WAYS[way](params, scene=LOADED)
    assert float(after.robot.total_mass) == pytest.approx(OWN + 2.0)
    same(after, env.make_params(scene=LOADED))
    same(WAYS[way](after, scene=BARE), params)
    drawn = Randomisation(payload=(2.0, 2.0))
    after = WAYS[way](params, randomisation=drawn)
    same(after, env.make_params(randomisation=drawn))
    state = env.reset(jax.random.key(0), after)[1]
    assert float(drawn_robot(state.drawn, after).total_mass) == pytest.approx(OWN + 2.0)
    assert WAYS[way](after, randomisation=Randomisation()).unit_payload is None


def test_another_robot_is_prepared_with_the_payload_type_and_fidelity_of_before():
    env, params = task()
    heavy = BipedParams.from_bars(hip_mass=1.7)
    for after in (
        params.replace(scene=LOADED).replace(robot=heavy),
        params.replace(robot=heavy, scene=LOADED),
        replace(params, scene=LOADED, robot=prepare(heavy, fidelity="table")),
    ):
        assert float(after.robot.total_mass) == pytest.approx(OWN + 3.0)
        same(after, env.make_params(robot=heavy, scene=LOADED))
    with pytest.raises(ValueError, match=r"robot = BipedParams.*accepted: a BipedModel"):
        replace(params, robot=heavy)
    same(env.make_params(robot=prepare(heavy, fidelity="joint")), env.make_params(robot=heavy))
    with pytest.raises(ValueError, match=r"'biped' is no parameter of BipedEnv; accepted: robot"):
        env.make_params(biped=heavy)  # pyright: ignore[reportCallIssue]
    with pytest.raises(ValueError, match="'unit_payload' is no field"):
        params.replace(unit_payload=None)


def test_a_model_is_prepared_anew_from_what_is_replaced():
    model = prepare(BipedParams.from_bars(), fidelity="reduced")
    heavy = BipedParams.from_bars(hip_mass=1.7)
    same(replace(model, bare=heavy), prepare(heavy))
    same(model.replace(payload=1.0), prepare(BipedParams.from_bars(payload=1.0)))
    same(replace(model, payload=2.0), prepare(model.bare, payload=2.0))
    assert model.fidelity == replace(replace(model, fidelity="joint"), fidelity="reduced").fidelity
    for name in ("fitted", "own_mass", "step_length", "closes", "symmetric"):
        with pytest.raises((ValueError, TypeError), match=name):  # the latter from Python 3.13 on
            replace(model, **{name: getattr(model, name)})


def test_payloads_are_carried_inside_transformations():
    params = task(fidelity="reduced")[1]

    def mass(payload):
        scene = Scene.uniform(0.06, 0.05, payload=payload)
        return replace(params, scene=scene).robot.total_mass

    kilograms = jnp.asarray([0.0, 1.0, 2.5])
    np.testing.assert_allclose(jax.jit(jax.vmap(mass))(kilograms), OWN + kilograms, rtol=1e-6)
    np.testing.assert_allclose(jax.grad(mass)(1.0), 1.0, rtol=1e-6)
    batch = jax.vmap(lambda kg: params.replace(scene=replace(LOADED, payload=kg)))(kilograms)
    shorter = replace(batch, time_limit=1.0)  # nothing to prepare, or member by member
    np.testing.assert_allclose(shorter.robot.total_mass, OWN + kilograms, rtol=1e-6)
    more = replace(batch, scene=replace(batch.scene, payload=kilograms + 1))
    np.testing.assert_allclose(more.robot.total_mass, OWN + 1 + kilograms, rtol=1e-6)


def test_a_load_stays_on_the_robot_that_is_replaced():
    model = prepare(BipedParams.from_bars())
    unit = model.unit_inertia()
    loaded = load(model, unit, 1.5, 2.0)
    own = float(model.total_mass)
    assert float(loaded.total_mass) == pytest.approx(1.5 * own + 2.0)
    heavy = replace(loaded, bare=BipedParams.from_bars(hip_mass=1.7))
    assert float(heavy.total_mass) == pytest.approx(1.5 * (own + 1.0) + 2.0)
    want = load(prepare(heavy.bare), unit, 1.5, 2.0)
    same(heavy.inertia.at(jnp.asarray(2.0)), want.inertia.at(jnp.asarray(2.0)))
    with pytest.raises(ValueError, match="robot carries a load"):
        replace(BipedEnv().default_params, robot=load(model, None, 2.0))


def test_a_batch_of_robots_is_prepared_member_by_member():
    lengths = np.asarray([0.03, 0.045])
    both = prepare(BipedParams.from_bars(crank_length=lengths))
    for i, length in enumerate(lengths):
        one = prepare(BipedParams.from_bars(crank_length=length))
        same(jax.tree.map(lambda leaf, i=i: leaf[i], both), one)
    with pytest.raises(ValueError, match=r"do not broadcast.*crank \(2,\)"):
        prepare(replace(both.bare, mass=np.ones((3, 13))))


@pytest.mark.parametrize("way", WAYS)
def test_a_drive_that_goes_farther_has_its_own_arc_length(way):
    env = UGVEnv()
    params = env.make_params()
    farther = WAYS[way](params, end=float(params.end) + 3.0)
    assert float(farther.odometer.end) >= float(farther.end)
    earlier = WAYS[way](params, start=float(params.start) - 3.0)
    assert float(earlier.odometer.start) <= float(earlier.start)
    shorter = WAYS[way](params, end=float(params.end) - 1.0)
    assert shorter.odometer is params.odometer or way == "method"
    same(shorter.odometer, params.odometer)
    moved = jax.jit(lambda end: replace(params, end=end).odometer.end)(float(params.end) + 3.0)
    assert float(moved) == pytest.approx(float(params.end) + 3.0)


@pytest.mark.parametrize("way", WAYS)
def test_failing_stays_dearer_than_driving_whatever_is_replaced(way):
    env = UGVEnv()
    params = env.make_params()
    new = {"friction": 1.6, "vehicle": UGVParams(body_mass=600.0), "start": 3.0}
    for name, value in new.items():
        after = WAYS[way](params, **{name: value})
        assert float(after.failure_penalty) != float(params.failure_penalty)
    slippery = WAYS[way](params, randomisation=UGVRandomisation(friction=(0.2, 1.6)))
    grippy = WAYS[way](params, friction=1.6)
    assert float(slippery.failure_penalty) == pytest.approx(float(grippy.failure_penalty))
    own = params.replace(failure_penalty=7.0)
    assert float(WAYS[way](own, friction=1.6).failure_penalty) == 7.0
    back = own.replace(failure_penalty=None)
    assert float(back.failure_penalty) == pytest.approx(float(params.failure_penalty))


def test_axes_to_map_over_are_replaced_as_what_they_are():
    for params in (task()[1], UGVEnv().default_params):
        axes = replace(jax.tree.map(lambda _: 0, params), randomisation=None)
        assert set(jax.tree.leaves(axes)) == {0}


def test_an_adapter_cannot_be_given_other_parameters_than_it_was_compiled_with():
    from stickslip.envs import GymEnv, GymVectorEnv

    env, params = task(autoreset="disabled")
    for adapter in (GymEnv(env, params), GymVectorEnv(env, params, 2)):
        assert adapter.params is params
        with pytest.raises(AttributeError):
            adapter.params = params.replace(time_limit=1.0)
