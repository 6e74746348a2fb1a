"""What a sweep may vary of the biped and the UGV, and that it comes out as set by hand."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import evaluate, read_sweep, sweep, sweep_arrays
from stickslip.agents.biped.controllers import ConstantTorque, CrankSpeedPI
from stickslip.agents.machine import machine_by_name
from stickslip.agents.sweeps.plan import Case
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import ROBOT
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.dynamics.ugv.params import VEHICLE
from stickslip.envs import BipedEnv, Randomisation, UGVEnv
from tests.trees import assert_same

SHORT = 0.1
BIPED, UGV = (machine_by_name(name).swept() for name in ("biped", "ugv"))


def close(one: object, other: object) -> None:
    assert_same(one, jax.tree.map(jnp.asarray, other), rtol=2e-5, atol=1e-6)


def put(swept, params, **values: float):
    """The parameters with axes set, made inside a batched program and taken out of it."""
    opened = swept.opened(params, values)
    targets = {one: v for name, v in values.items() for one in swept.targets(opened, name)}
    points = {name: jnp.full(2, value, jnp.float32) for name, value in targets.items()}
    made = jax.jit(jax.vmap(lambda point: swept.put(opened, point)))(points)
    return jax.tree.map(lambda leaf: leaf[1], made)


def test_axes_of_the_biped_are_what_make_params_makes_of_the_numbers():
    env, floor = BipedEnv(), Scene.uniform(0.1, 0.1, payload=3.0)
    params = env.make_params(scene="grip")
    heavy = BipedParams.from_bars()
    heavy = replace(heavy, mass=jnp.asarray(heavy.mass).at[12].set(0.9))
    expected = env.make_params(scene=floor, robot=heavy, mean_rate=5.0, slip_weight=2.0)
    names = {"mu": 0.1, "payload": 3.0, "robot.mass.12": 0.9, "slip_weight": 2.0}
    close(put(BIPED, params, **names, mean_rate=5.0), expected)


def test_axes_of_the_ugv_are_what_make_params_makes_of_the_numbers():
    env = UGVEnv()
    way = {"start": 2.0, "end": 6.0}  # waypoints stay where the task has them
    params = env.make_params(track=Track.bump(0.1, width=1.0), **way)
    made = put(UGV, params, height=0.2, **{"vehicle.body_mass": 200.0}, friction=0.6)
    track, vehicle = Track.bump(0.2, width=1.0), UGVParams(body_mass=200.0)
    close(made, env.make_params(track=track, vehicle=vehicle, friction=0.6, **way))


def test_an_axis_of_every_number_of_both_machines_is_what_set_makes_of_it():
    env, van = BipedEnv(), UGVEnv()
    params, other = env.make_params(), van.make_params()
    for name, place in ROBOT.names.items():
        opened = BIPED.opened(params, {name}) if name.startswith("motor.") else params
        (target,) = BIPED.targets(opened, name)
        assert target in BIPED.known(opened)
        assert target.startswith("task.") or ROBOT.names[target] == place
    tibia = {"robot.mass.tibia": 0.9, "robot.centre.tibia.x": 0.2, "robot.crank_length": 0.04}
    close(put(BIPED, params, **tibia).robot.bare, BipedParams.from_file(None, tibia))
    limits = {"motor.max_power", "motor.speed"}  # a file's words for a torque limit
    for name in VEHICLE.names.keys() - limits:
        opened = UGV.opened(other, {name})
        (target,) = UGV.targets(opened, name)
        part, _, field = target.partition(".")
        value = UGV.parts(opened)[part][field] * 1.01 + 1e-3 * (field == "wheel_gap")
        assert UGV.parts(UGV.put(opened, {target: value}))[part][field] == pytest.approx(value)


def test_what_an_axis_sets_is_no_longer_drawn():
    drawn = Randomisation(
        friction=(0.5, 1.0), payload=(0.0, 1.0), mean_rate=(2.0, 3.0), crank_rate=(0.0, 3.0)
    )
    params = BipedEnv().make_params(randomisation=drawn, scene="slippery")
    values = {"scene.mu_static": 0.3, "scene.payload": 2.0, "task.mean_rate": 6.0}
    opened = BIPED.opened(params, ["payload", "mu_static", "mean_rate"])
    left = BIPED.put(opened, values).randomisation
    assert (left.friction, left.payload, left.mean_rate) == (None, None, None)
    assert [float(one) for one in left.crank_rate] == [0, 6]  # begun up to the commanded rate
    assert BIPED.put(params, {"task.slip_weight": 1.0}).randomisation == drawn


def test_every_name_of_the_help_is_an_axis_and_every_axis_has_a_known_unit():
    for name, env in (("biped", BipedEnv()), ("ugv", UGVEnv())):
        machine = machine_by_name(name)
        swept, drawn = machine.swept(), env.make_params()
        if name == "ugv":
            drawn = env.make_params(track="random-bump")
        for words in machine.axes:
            for word in words.split(", "):
                ranged = word.startswith("randomisation.track")
                params = drawn if ranged else swept.opened(env.make_params(), [word])
                if word == "randomisation.friction.0":
                    params = env.make_params(randomisation=Randomisation(friction=(0.5, 1.0)))
                assert swept.targets(params, word)
    assert BIPED.unit("robot.mass.12") == BIPED.unit("randomisation.payload.1") == "kg"
    assert BIPED.unit("scene.edges.0") == BIPED.unit("robot.centre.3.1") == "m"
    assert UGV.unit("track.height") == UGV.unit("randomisation.track.bump_height.1") == "m"
    for swept, params in ((BIPED, BipedEnv().make_params()), (UGV, UGVEnv().make_params())):
        assert {name for name in swept.known(params) if swept.unit(name) == "-"} <= WITHOUT


WITHOUT = {
    *(f"task.{one}_weight" for one in ("tracking", "slip", "energy")),
    *("task.fall_penalty", "task.friction", "task.reward_scale", "task.failure_penalty"),
    *("scene.mu_static", "scene.mu_kinetic"),
}
"""Numbers that are ratios, or in the unit of a reward."""


def refused(params, axes: dict, env=None) -> str:
    env = BipedEnv() if env is None else env
    machine = machine_by_name("biped" if isinstance(env, BipedEnv) else "ugv")
    player = CrankSpeedPI() if isinstance(env, BipedEnv) else machine.baseline("level-body", env)
    with pytest.raises(ValueError, match=r"no number|at ") as error:
        Case.of(machine, axes, ("own", env, params), "one", player)
    return str(error.value)


def test_axes_that_change_the_program_or_the_task_will_not_do_are_refused():
    slippery, grip = (BipedEnv().make_params(scene=one) for one in ("slippery", "grip"))
    assert "'fidelity' is no number of this task" in refused(slippery, {"fidelity": [1.0]})
    assert "mu_static" in refused(grip, {"scene.mu_static": [0.1]})
    assert "did you mean" in refused(slippery, {"comanded_rate": [0.1]})
    said = refused(slippery, {"mu_static": [0.04, 0.2]})
    assert said.startswith("at mu_static = 0.04: mu_kinetic")
    assert "mean_rate" in refused(slippery, {"mean_rate": [-1.0, 2.0]})
    assert "friction" in refused(UGVEnv().make_params(), {"friction": [-1.0]}, UGVEnv())


def test_of_many_axes_those_that_go_together_are_checked_and_give_the_steps():
    axes = {"mean_rate": [2, 3], "slip_weight": [0.1, 0.2], "payload": [0, 1], "gravity": [9, 10]}
    axes |= {"energy_weight": [0.1, 0.2], "fall_penalty": [0, 1], "copper_loss": [0, 1]}
    env, ends = BipedEnv(), {"time_limit": [0.5, 20.0], "control_period": [0.01, 0.04]}
    place = "own", env, env.make_params(scene=Scene.uniform(0.8))
    assert (
        Case.of(machine_by_name("biped"), ends | axes, place, "one", ConstantTorque()).steps == 2000
    )
    frictions = {"mu_static": [0.2, 0.5], "mu_kinetic": [0.1, 0.4]}
    assert "exceeds mu_static" in refused(place[2], frictions | axes)


@pytest.mark.long  # test_sweep compares the mass with evaluate
def test_the_biped_is_swept_as_it_is_evaluated(tmp_path):
    drawn = Randomisation(phase=(1.6, 4.7), crank_rate=(0.0, 3.0))
    env = BipedEnv(autoreset="disabled")
    params = env.make_params(time_limit=SHORT, randomisation=drawn, max_crank_rate=6.0)
    player = ConstantTorque(4.0)
    done = sweep(
        (env, params), {"push": player}, {"mu": [0.02, 0.4], "time_limit": [SHORT]}, 8, tmp_path
    )
    assert (done.episodes, done.cells) == (16, 1)
    found = sweep_arrays(tmp_path)
    scene = Scene.uniform(0.4, 0.4)
    told = evaluate(env, {"push": player}, {"": params.replace(scene=scene)}, episodes=8)
    expected = told.row("", "push").episodes
    for name in ("reward", "duration", "slid", "energy", "weight"):
        mine = found[name][0, 0, 1, 0]
        assert np.allclose(mine, getattr(expected, name), rtol=1e-3, atol=1e-5)
    assert np.array_equal(found["ending"][0, 0, 1, 0], expected.status)
    endings = set(read_sweep(tmp_path)["ending"].to_pylist())
    assert "topple" in endings  # and those that went on stand beside them
    assert endings - {"topple", "lift_off", "runaway"}
    assert np.all(np.isfinite(found["reward"]))


@pytest.mark.long
@pytest.mark.usefixtures("xla_defaults")
def test_the_biped_is_the_same_to_the_bit_in_cells_of_any_size(tmp_path: Path):
    axes, tables = {"mu": "0.02:0.3:6", "payload": "0:10:5"}, []
    for cell, cores in ((256, 2), (96, 1), (2048, 1)):
        out = tmp_path / str(cell)
        how = {"cell": cell, "executor": ThreadPoolExecutor(cores)}
        sweep("BipedPayload-v0", ["crank-speed-pi"], axes, 48, out, **how)
        tables.append(read_sweep(out).combine_chunks())
    assert all(one.equals(tables[0]) for one in tables[1:])
