"""A policy's file holds the task it was made for, and the commands take it from there."""

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import describe_environment, evaluate, load_policy
from stickslip.agents.biped.task import from_anywhere
from stickslip.agents.machine import machine_by_name
from stickslip.cli import OK, main
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from stickslip.envs import BipedEnv, Randomisation, UGVEnv
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation
from tests.agents.networks import still
from tests.asked import prints
from tests.precision import mostly_single
from tests.trees import assert_same

pytestmark = pytest.mark.usefixtures("empty_directory")

BIPED, UGV = machine_by_name("biped"), machine_by_name("ugv")


def through_json(about: dict) -> dict:
    return json.loads(json.dumps(about, allow_nan=False))


def strange_biped(dtype=None, **changes) -> tuple[BipedEnv, object]:
    """Nothing as in the standard task."""
    env = BipedEnv(see_friction=True, fidelity="chebyshev", substeps=2)
    given = {
        "robot": BipedParams.from_bars(crank_length=0.0217, hip_mass=0.93),
        "scene": Scene.patches([0.1, 0.37], [0.5, 0.061, 0.3], [0.4, 0.051, 0.2], payload=1.7),
        "randomisation": Randomisation(friction=(0.81, 1.23), mass=(0.9, 1.1)),
        "torque_limit": 3.3,
        "control_period": 0.013,
        "mean_rate": 2.7,
        "time_limit": 0.4,
        "slip_weight": 4.1,
    }
    return env, env.make_params(dtype=dtype, **(given | changes))


@mostly_single
def test_a_biped_task_comes_back_to_the_last_bit(dtype):
    env, params = strange_biped(dtype)
    task = BIPED.read_task(through_json(describe_environment(env, params)))
    assert task is not None
    assert task.env == env
    assert_same(task.params, params)


@pytest.mark.parametrize("ground", ["points", "drawn"])
def test_a_ugv_task_comes_back_to_the_last_bit(ground: str):
    x = np.linspace(0, 9, 400)
    points = Track.from_points(x, 0.04 * np.sin(1.3 * x))
    drawn = UGVRandomisation(RandomTrack((0.03, 0.11), waves=16), (0.5, 0.9), (1.1, 1.9))
    env = UGVEnv("peak_torque", 5, PoseSolver(iterations=4, samples=4))
    params = env.make_params(
        vehicle=UGVParams(body_length=0.91, wheel_radius=0.31),
        track=points if ground == "points" else Track.ramp(0.13),
        randomisation=drawn if ground == "drawn" else None,
        friction=0.63,
        leg_rate=1.9,
        spacing=0.17,
        start_angles=(1.4, 1.8),
        preview_length=3.1,
        preview_noise=0.003,
        failure_penalty=123.4,
        reward_scale=0.5,
    )
    task = UGV.read_task(through_json(describe_environment(env, params)))
    assert task is not None
    assert task.env == env
    assert_same(task.params, params)


def test_a_task_that_no_file_can_keep_is_left_out_and_said():
    env = UGVEnv()
    params = env.make_params(track=Track.from_function(lambda x: 0.01 * jnp.sin(x)))
    about = through_json(describe_environment(env, params))
    assert about["task"] is None
    assert "cannot be kept" in about["task_missing"]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("robot", "kind"), "os.system"),
        (("robot", "crank"), {"array": "AAAA", "shape": [9], "type": "float32", "host": False}),
        (("env", "substeps"), 10**9),
        (("numbers", "named", "torque_limit"), -1.0),
    ],
)
def test_a_damaged_task_is_refused(place, value):
    env = BipedEnv()
    about = through_json(describe_environment(env, env.default_params))
    at, key = about, "task"
    for name in place:
        at, key = at[key], name
    at[key] = value
    with pytest.raises(ValueError, match="task"):
        BIPED.read_task(about)


def rows_of(path: str) -> list[dict]:
    return json.loads(Path(path, "evaluation.json").read_text())["rows"]


def test_a_policy_is_evaluated_on_its_own_task_and_options_override(capsys):
    env, params = strange_biped()
    size = len(env.observation_bounds(params)[0])
    name = still("own.npz", size, describe_environment(env, params), push=0.2)
    said = prints(capsys, "evaluate", name, "--episodes", "3", "--out", "a")
    label = "3 patches, +1.7 kg, 2.7 rad/s, random friction, mass"
    assert f"{label}, robot of" in said
    assert "the own task of own.npz" in said
    assert "torque limit 3.3" in said
    (row,) = rows_of("a")
    assert row["scene"] in said
    expected = evaluate(env, {"x": load_policy(name)}, {"y": from_anywhere(params)}, episodes=3)
    assert row["per_episode"]["reward"] == pytest.approx(expected.rows[0].episodes.reward.tolist())
    flags = ["--set", "mu_static=0.3", "mu_kinetic=0.2", "payload=0", "--start", "rest"]
    said = prints(capsys, "evaluate", name, "--episodes", "3", "--out", "b", *flags)
    assert "mu 0.3/0.2, +0 kg, 2.7 rad/s, random mass" in said
    changed = "--start rest --set mu_static=0.3 mu_kinetic=0.2 payload=0"
    assert f"the own task of own.npz with {changed}" in said
    (row,) = rows_of("b")
    assert row["scene"].startswith("mu 0.3/0.2")
    floor = Scene.uniform(0.3, 0.2, payload=0.0)
    _, other = strange_biped(scene=floor, randomisation=Randomisation(mass=(0.9, 1.1)))
    expected = evaluate(env, {"x": load_policy(name)}, {"y": other}, episodes=3)
    assert row["per_episode"]["reward"] == pytest.approx(expected.rows[0].episodes.reward.tolist())


@pytest.mark.long
def test_several_policies_each_stand_on_their_own_task(capsys):
    env = BipedEnv()
    slow, wet = (
        env.make_params(time_limit=0.2, **changes)
        for changes in ({"mean_rate": 2.0}, {"scene": Scene.uniform(0.2, 0.15)})
    )
    seeing = BipedEnv(see_friction=True)
    first = still("first.npz", 6, describe_environment(env, slow))
    second = still("second.npz", 6, describe_environment(env, wet))
    third = still("third.npz", 8, describe_environment(seeing, wet))
    names = [first, second, third, "constant-torque"]
    assert main(["evaluate", *names, "--episodes", "2", "--out", "a"]) == OK
    assert [(row["scene"], row["controller"]) for row in rows_of("a")] == [
        ("slippery, 2 rad/s", first),
        ("slippery, 2 rad/s", "constant-torque"),
        ("wet", second),
        ("wet", third),
        ("wet", "constant-torque"),
    ]
    capsys.readouterr()
    common = ["--scene", "firm", "--set", "mean_rate=3", "--episodes", "2", "--out", "b"]
    assert main(["evaluate", *names, *common]) == OK
    assert {row["scene"] for row in rows_of("b")} == {"firm"}
