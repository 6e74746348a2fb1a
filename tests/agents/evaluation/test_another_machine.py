"""A controller of one machine in the hands of another is refused by name, wherever it is played."""

from dataclasses import dataclass

import jax.numpy as jnp
import pytest

from stickslip.agents import CrankSpeedPI, LevelBody, Optimum, evaluate, rollout, show
from stickslip.agents.protocol import Memoryless
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs import BipedEnv, UGVEnv

UGV = r"CrankSpeedPI reads 'biped' of a UGVEnvState, which has none; accepted: .* for UGVEnv"
BIPED = (
    r"LevelBody reads 'leg_angles' of a BipedEnvState, which has none; accepted: .* for BipedEnv"
)
PLAN = r"Optimum reads 'problem' of a BipedEnv, which has none; accepted: .* for BipedEnv"


@pytest.fixture(scope="module")
def ugv():
    env = UGVEnv()
    return env, env.make_params()


@pytest.fixture(scope="module")
def biped():
    env = BipedEnv()
    return env, env.make_params()


def test_the_bipeds_controller_does_not_drive(ugv):
    env, params = ugv
    with pytest.raises(ValueError, match=UGV):
        rollout(env, CrankSpeedPI(), params, 0)  # pyright: ignore[reportArgumentType], refused
    with pytest.raises(ValueError, match=UGV):
        show(env, CrankSpeedPI(), params)


@pytest.mark.parametrize(("player", "message"), [(LevelBody(), BIPED), (Optimum(), PLAN)])
def test_the_ugvs_player_does_not_walk(biped, player, message):
    env, params = biped
    with pytest.raises(ValueError, match=message):
        evaluate(env, {"driver": player}, {"grip": params}, episodes=1)
    with pytest.raises(ValueError, match=message):
        show(env, player, params)


@register_pytree
@dataclass(frozen=True)
class Mistaken(Memoryless):
    """A user's controller that reads what an array does not have."""

    def act(self, memory, obs, env_state, env_params):
        """See Controller."""
        return memory, jnp.ones(1) * obs.speed

    def validate(self):
        """See Controller."""
        return self


def test_a_mistake_of_another_kind_stays_what_it_is(biped):
    env, params = biped
    with pytest.raises(AttributeError, match="speed"):
        rollout(env, Mistaken(), params, 0)
