"""What is handed to evaluations in the wrong place is refused by its name, before any episode."""

import re

import pytest

from stickslip.agents import (
    CrankSpeedPI,
    Optimum,
    describe_environment,
    evaluate,
    load_policy,
    rollout,
    save_policy,
    train,
)
from stickslip.envs import BipedEnv, UGVEnv, collect

ENV, WHO = BipedEnv(), CrankSpeedPI()
VEHICLE = UGVEnv()
NAMED = {"held": WHO}


def places():
    return {"here": ENV.default_params}


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: evaluate(ENV, NAMED, ENV.default_params), "scenes = Biped"),  # pyright: ignore[reportArgumentType]
        (lambda: evaluate(ENV, NAMED, {"a": VEHICLE.default_params}), "scenes['a'] = UGV"),  # pyright: ignore[reportArgumentType]
        (lambda: evaluate(ENV, {"c": CrankSpeedPI}, places()), "accepted: CrankSpeedPI(...)"),  # pyright: ignore[reportArgumentType]
        (lambda: evaluate(ENV, NAMED, places(), episodes=0), "episodes = 0"),
        (lambda: rollout(ENV, WHO, ENV.default_params, 3.0), "key = 3.0; accepted: an integer"),  # pyright: ignore[reportArgumentType]
        (lambda: rollout(VEHICLE, Optimum(), VEHICLE.default_params, 0), "controller = Opt"),  # pyright: ignore[reportArgumentType]
        (
            lambda: rollout(VEHICLE, WHO, VEHICLE.default_params, 0),
            "reads 'biped' of a UGVEnvState",
        ),  # pyright: ignore[reportArgumentType]
        (lambda: load_policy(3), "name = 3; accepted: the name of a policy"),  # pyright: ignore[reportArgumentType]
        (lambda: describe_environment(ENV, VEHICLE.default_params), "params = UGV"),  # pyright: ignore[reportArgumentType]
        (lambda: save_policy(WHO, "mine.npz"), "policy = Crank"),  # pyright: ignore[reportArgumentType]
        (lambda: train("biped", "run"), "config = 'biped'"),  # pyright: ignore[reportArgumentType]
        (lambda: collect(ENV, ENV.default_params, len, num_envs=1, steps=1, seed=-1), "seed = -1"),
    ],
)
def test_what_stands_in_the_wrong_place_is_refused_by_name(call, said):
    with pytest.raises(ValueError, match=re.escape(said)) as refused:
        call()
    assert "accepted: " in str(refused.value)
