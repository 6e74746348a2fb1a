"""What options of a reset make of an episode of either machine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.ugv import Track
from stickslip.envs import (
    BipedEnv,
    GymEnv,
    Randomisation,
    RandomTrack,
    UGVEnv,
    UGVRandomisation,
)
from tests.envs.helpers import RANGES, CompileCount, make, task
from tests.envs.test_names import same
from tests.envs.ugv import helpers as ugv_helpers

CLOSE = {"rtol": 1e-5, "atol": 1e-5}
"""Single precision, in programs that are compiled differently: numbers that a step is compiled
with, and numbers that it is passed."""


def episode(env: GymEnv, options: dict[str, Any] | None = None, seed: int = 4) -> list[np.ndarray]:
    """Observations, and rewards and infos, of an episode's first steps."""
    seen, told = [env.reset(seed=seed, options=options)[0]], []
    random = np.random.default_rng(1)
    for _ in range(25):
        action = random.uniform(-0.1, 0.3, env.action_space.shape).astype(np.float32)
        obs, reward, terminated, truncated, info = env.step(action)
        seen.append(obs)
        told.append([reward, *info.values()])
        if terminated or truncated:
            break
    return [np.asarray(seen), np.asarray(told, float)]


def test_the_bipeds_start_is_bit_by_bit_that_of_parameters_with_it():
    options = {"phase": 4.0, "crank_rate": 2.0, "mean_rate": 2.5}
    drawn = Randomisation(**{one: (value, value) for one, value in options.items()})
    # The same steps: only the reset differs, which is compiled with these numbers or passed them.
    made = episode(GymEnv(BipedEnv(autoreset="disabled"), task()[1].replace(randomisation=drawn)))
    given = episode(make(), options)
    assert len(given[0]) > 10
    for one, other in zip(given, made, strict=True):
        assert np.array_equal(one, other)


SCENES: dict[str, Any] = {
    "uniform": {"scene": Scene.uniform(0.11, 0.08)},
    "ice": {"scene": "ice-patch", "crank_rate": 3.0},
    "payload": {"payload": 0.7, "mass": 1.1},
}


@pytest.mark.parametrize(
    "name", ["uniform", *(pytest.param(n, marks=pytest.mark.long) for n in [*SCENES][1:])]
)
def test_the_bipeds_scene_is_that_of_parameters_with_it(name):
    options = dict(SCENES[name])
    starts = ("phase", "crank_rate", "mass")
    drawn = Randomisation(**{n: (options[n],) * 2 for n in starts if n in options})
    scene = options.get("scene", Scene.uniform(0.06, 0.05, payload=options.get("payload")))
    given = episode(make(), options)
    made = episode(make(scene=scene, randomisation=drawn))
    for one, other in zip(given, made, strict=True):
        np.testing.assert_allclose(one, other, **CLOSE)


def test_parameters_of_an_episode_are_what_make_params_gives():
    env = BipedEnv()
    params = env.make_params(randomisation=RANGES)
    options = {"scene": "wet", "payload": 0.5, "phase": 2.0, "crank_rate": 1.0}
    options |= {"mean_rate": 2.0, "mass": 0.9}
    drawn = Randomisation(
        mass=(0.9, 0.9), mean_rate=(2.0, 2.0), phase=(2.0, 2.0), crank_rate=(1.0, 1.0)
    )
    made = env.make_params(scene=Scene.named("wet", payload=0.5), randomisation=drawn)
    assert same(env.episode_params(params, options), made)
    assert same(params, env.make_params(randomisation=RANGES))


GROUND = UGVRandomisation(RandomTrack((0.0, 0.1)), (0.5, 0.9), (1.0, 2.0))


@pytest.mark.parametrize("before", [UGVRandomisation(), GROUND])
@pytest.mark.parametrize("track", ["sinusoid", "random-rough", Track.bump(0.05, 5.0, end=11.0)])
def test_parameters_of_a_drive_are_what_make_params_gives(before, track):
    env = UGVEnv()
    params = env.make_params(randomisation=before)
    options = {"track": track, "friction": 0.6, "start_angles": (1.5, 1.7)}
    given = env.episode_params(params, options)
    spacing = float(params.spacing) * (1 + 1e-6)
    made = {"spacing": spacing, "vehicle": params.vehicle, "friction": 0.6}
    made = env.make_params(track=track, start_angles=(1.5, 1.7), **made)
    assert same(given, made)
    only = env.episode_params(params, {"start_angles": (1.5, 1.7)})
    drawn = UGVRandomisation(before.track, before.friction)
    assert same(only, env.make_params(start_angles=(1.5, 1.7), randomisation=drawn))
    assert same(env.read_by_steps(only), env.read_by_steps(params))
    assert not same(env.read_by_steps(given), env.read_by_steps(params))


@pytest.mark.long
def test_a_ugvs_drive_is_that_of_parameters_with_its_options():
    def env(**more: Any) -> GymEnv:
        return ugv_helpers.make("short", **more)

    base = env()
    start = {"start_angles": (1.4, 1.7)}
    given, made = episode(base, start), episode(env(**start))
    for one, other in zip(given, made, strict=True):
        np.testing.assert_allclose(one, other, **CLOSE)
    track = Track.ditch(0.05, 2.6, end=3.5)
    given = episode(base, {"track": track, "friction": 0.6, **start})
    spacing = float(base.params.spacing) * (1 + 1e-6)
    made = episode(env(track=track, friction=0.6, spacing=spacing, **start))
    assert len(given[0]) > 10
    for one, other in zip(given, made, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-3)  # of energies in J
    with CompileCount() as compiled:
        episode(base, {"track": Track.ditch(0.02, 2.5, end=3.5), "friction": 0.5, **start})
    assert compiled.count == 0


def test_other_numbers_of_a_bipeds_start_and_floor_compile_nothing():
    env = make()

    def use(turn: int) -> None:
        env.reset(seed=turn, options={"phase": 2.0 + 0.1 * turn})
        env.step(np.full(1, 0.1, np.float32))
        env.reset(options={"crank_rate": 0.1 * turn, "mean_rate": 2.0 + turn})
        env.reset(options={"scene": Scene.uniform(0.1 + 0.01 * turn, 0.1)})
        env.step(np.full(1, 0.1, np.float32))
        env.reset()

    use(0)
    with CompileCount() as compiled:
        for turn in range(1, 4):
            use(turn)
    assert compiled.count == 0


BAD: list[tuple[Any, str]] = [
    ({"phas": 2.0}, r"'phas' is no option of reset; accepted: scene, .*did you mean phase\?"),
    ({"phase": 0.1}, r"phase = 0\.1 is not accepted; accepted: an angle within pi/2 to 3 pi/2"),
    ({"phase": np.nan}, r"phase = nan is not accepted"),
    ({"phase": [2.0, 3.0]}, r"phase has shape \(2,\).*one number"),
    ({"payload": -1.0}, r"payload = -1\.0 is not accepted; accepted: a finite mass"),
    ({"scene": "frim"}, r"scene = 'frim' is unknown.*did you mean firm\?"),
    ({"scene": Scene.uniform(0.5, outputs="state")}, r"other entries; accepted: a scene"),
]


@pytest.mark.parametrize(("options", "message"), BAD)
def test_bad_options_of_the_biped_are_refused(options, message):
    env = make()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)


def test_a_floor_that_would_change_what_is_seen_is_refused():
    env = make(see_friction=True)
    with pytest.raises(ValueError, match=r"would change what is observed; accepted: a scene"):
        env.reset(options={"scene": "grip"})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"trak": "bump"}, r"'trak' is no option of reset; accepted: track, .*mean track\?"),
        ({"track": "bupm"}, r"track = 'bupm' is unknown.*did you mean bump\?"),
        ({"track": Track.flat(end=1.0)}, r"accepted: start < end on a track longer than"),
        ({"start_angles": (np.nan, 1.5)}, r"start_angles = nan"),
    ],
)
def test_bad_options_of_the_ugv_are_refused(options, message):
    env = UGVEnv()
    params = env.default_params
    with pytest.raises(ValueError, match=message):
        env.episode_params(params, options)
