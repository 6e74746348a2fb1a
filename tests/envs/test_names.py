"""Scenes and tracks are known by their names wherever Python is given one."""

from __future__ import annotations

import inspect

import gymnasium
import numpy as np
import pytest

from stickslip.dynamics import Scene, recommend
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from stickslip.dynamics.names import RANDOM_TRACKS, SCENES
from stickslip.dynamics.ugv import TRACKS, Odometer, Track, UGVParams, equilibrium, pose
from stickslip.envs import BipedEnv, RandomTrack, UGVEnv, UGVRandomisation
from stickslip.optim import PostureProblem
from tests.envs.helpers import BIPED, make
from tests.envs.ugv.helpers import UGV
from tests.trees import assert_same

PLACE = (4.0, (1.5, 1.6))


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_by_name_makes_the_parameters_of_the_scene(name):
    env, scene = BipedEnv(), Scene.named(name)
    assert_same(env.make_params(scene=name), env.make_params(scene=scene))
    assert_same(env.default_params.replace(scene=name), env.default_params.replace(scene=scene))


def test_a_named_scene_takes_the_options_of_a_scene():
    given = {"payload": 1.5, "steps": "one"}
    assert_same(Scene.named("wet", **given), Scene.uniform(0.2, 0.15, **given))
    assert Scene.named("grip", outputs="state") == Scene.grip(outputs="state")


@pytest.mark.parametrize("name", [*(one for one in TRACKS if one != "rough"), "rough"])
def test_a_track_by_name_makes_the_parameters_of_the_track(name):
    env = UGVEnv()
    assert_same(env.make_params(track=name), env.make_params(track=Track.named(name)))


@pytest.mark.parametrize("name", RANDOM_TRACKS)
def test_a_random_track_by_name_is_drawn_on_level_ground(name):
    env, drawn = UGVEnv(), UGVRandomisation(RandomTrack.named(name), (0.5, 0.9))
    given = env.make_params(track=name, randomisation=UGVRandomisation(friction=(0.5, 0.9)))
    assert_same(given, env.make_params(track=Track.flat(), randomisation=drawn))
    again = env.make_params(track=name).replace(track=RANDOM_TRACKS[0]).randomisation.track
    assert type(again) is RandomTrack
    with pytest.raises(ValueError, match=r"beside a track in randomisation; accepted: one of them"):
        env.make_params(track=name, randomisation=drawn)


@pytest.mark.long
def test_the_mechanics_take_names():
    robot, start = BipedParams.from_bars(), BipedState()
    walks = [simulate(robot, s, start, 1.0, 0.1, 0.01) for s in ("firm", Scene.uniform(0.5, 0.4))]
    assert_same(*(walk.final for walk in walks))
    vehicle, bump = UGVParams(), Track.bump()
    assert_same(pose(vehicle, "bump", *PLACE), pose(vehicle, bump, *PLACE))
    assert_same(equilibrium(vehicle, "bump", *PLACE), equilibrium(vehicle, bump, *PLACE))
    assert_same(Odometer.along("bump"), Odometer.along(bump))
    assert np.array_equal(PostureProblem.along("bump").x, PostureProblem.along(bump).x)
    assert_same(PostureProblem(vehicle, "bump", [3.0, 4.0]).track, bump)
    assert recommend(1e-3, "wet").setting == recommend(1e-3, "stick-slip").setting


def test_gymnasium_keeps_the_name():
    env = gymnasium.make(BIPED, scene="ice-patch")
    assert env.spec is not None
    assert '"scene": "ice-patch"' in env.spec.to_json()
    assert_same(env.unwrapped.params.scene, make(scene=Scene.named("ice-patch")).params.scene)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Scene.named("slipery"), r"scene = 'slipery' is unknown.*did you mean slippery\?"),
        (lambda: BipedEnv().make_params(scene="gripp"), r"accepted: a Scene, .*mean grip\?"),
        (lambda: gymnasium.make(BIPED, scene="Wet"), r"scene = 'Wet' is unknown.*mean wet\?"),
        (lambda: Scene.named("wet", paylod=1.0), r"did you mean payload\?"),
        (lambda: gymnasium.make(UGV, track="bupm"), r"track = 'bupm'.*accepted: a Track, .*bump\?"),
        (lambda: UGVEnv().make_params(track="random-rought"), r"did you mean random-rough\?"),
        (lambda: pose(UGVParams(), "hill", *PLACE), r"track = 'hill' is unknown"),
        (lambda: recommend(1e-3, "wett"), r"did you mean wet\?"),
    ],
)
def test_another_name_is_refused_with_the_nearest(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize("kind", [BipedEnv, UGVEnv])
def test_make_params_shows_what_it_takes(kind):
    shown = inspect.signature(kind().make_params).parameters
    assert tuple(shown) == kind.parameter_names()
    assert shown["dtype"].default is None
