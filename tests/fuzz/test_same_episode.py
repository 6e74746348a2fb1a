"""One seed, one sequence of episodes: in every adapter, two processes, batches of 1, 5 and 1000."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv, GymEnv, GymVectorEnv, Randomisation
from tests.envs.toy import Toy, ToyParams
from tests.envs.ugv import helpers as ugv
from tests.fuzz.test_constructors import HAS_SB3

SEED, MANY, STEPS, CHOSEN = 7, 1000, 40, 3
DRAWN = np.random.default_rng(2).uniform(-1, 1, (STEPS, MANY, 2)).astype(np.float32)
OPTIONS = {
    "scene": Scene.uniform(0.06, 0.05),
    "time_limit": 0.6,
    "randomisation": Randomisation(friction=(0.5, 2.0), mass=(0.8, 1.2), crank_rate=(-1.0, 3.0)),
}
CLOSE = {"toy": 1e-6, "biped": 1e-5, "ugv": 2e-3}


def environment(name: str, autoreset: str) -> tuple[Any, Any]:
    if name == "toy":
        return Toy(autoreset), ToyParams()
    if name == "ugv":
        return ugv.task("random", autoreset=autoreset, preview=3)
    return BipedEnv(autoreset=autoreset), BipedEnv().make_params(**OPTIONS)


def recorded(first: Any, step: Callable[[int], tuple[Any, Any, Any]]) -> np.ndarray:
    """Rows of observation and reward; `step` gives both, and a next episode's first observation."""
    rows = [np.append(first, 0.0)]
    for i in range(STEPS):
        last, reward, following = step(i)
        rows.append(np.append(last, reward))
        if following is not None:
            rows.append(np.append(following, 0.0))
    return np.asarray(rows, np.float32)


def by_functional(name: str, actions: np.ndarray) -> np.ndarray:
    """The environment alone, by the functions themselves."""
    env, params = environment(name, "disabled")
    chain, key = jax.random.split(jax.random.key(SEED + CHOSEN))
    first, state = env.reset(key, params)

    def step(i: int) -> tuple[Any, Any, Any]:
        nonlocal chain, state
        action = jnp.asarray(actions[i, CHOSEN])
        obs, state, reward, terminated, truncated, _ = env.step(key, state, action, params)
        following = None
        if terminated or truncated:
            chain, after = jax.random.split(chain)
            following, state = env.reset(after, params)
        return obs, reward, following

    return recorded(first, step)


def by_single(name: str, actions: np.ndarray) -> np.ndarray:
    env = GymEnv(*environment(name, "disabled"))

    def step(i: int) -> tuple[Any, Any, Any]:
        obs, reward, terminated, truncated, _ = env.step(actions[i, CHOSEN])
        return obs, reward, env.reset()[0] if terminated or truncated else None

    return recorded(env.reset(seed=SEED + CHOSEN)[0], step)


def by_vector(name: str, actions: np.ndarray, count: int) -> np.ndarray:
    """Environment CHOSEN of a batch."""
    env = GymVectorEnv(*environment(name, "same_step"), count, "same_step")
    at = min(CHOSEN, count - 1)

    def step(i: int) -> tuple[Any, Any, Any]:
        obs, reward, terminated, truncated, infos = env.step(actions[i, CHOSEN - at :][:count])
        over = terminated[at] or truncated[at]
        last = infos["final_obs"][at] if over else obs[at]
        return last, reward[at], obs[at] if over else None

    return recorded(env.reset(seed=SEED + CHOSEN - at)[0][at], step)


def by_sb3(name: str, actions: np.ndarray, count: int) -> np.ndarray:
    from stickslip.envs import SB3VecEnv

    at = min(CHOSEN, count - 1)
    env = SB3VecEnv(*environment(name, "same_step"), count, seed=SEED + CHOSEN - at)

    def step(i: int) -> tuple[Any, Any, Any]:
        obs, reward, over, infos = env.step(actions[i, CHOSEN - at :][:count])
        last = infos[at]["terminal_observation"] if over[at] else obs[at]
        return last, reward[at], obs[at] if over[at] else None

    return recorded(env.reset()[at], step)


def rows_of(name: str, count: int) -> dict[str, np.ndarray]:
    """Rows by adapter, batches of 1 and of `count`."""
    actions = {"toy": DRAWN, "biped": DRAWN[..., :1], "ugv": 0.5 * DRAWN}[name]
    found = {"functional": by_functional(name, actions), "Gymnasium": by_single(name, actions)}
    for adapter, way in {"vector": by_vector, **({"SB3": by_sb3} if HAS_SB3 else {})}.items():
        found |= {f"{adapter} of {n}": way(name, actions, n) for n in (1, count)}
    return found


def digests() -> dict[str, str]:
    rows = rows_of("biped", MANY)
    return {name: hashlib.sha256(one.tobytes()).hexdigest() for name, one in rows.items()}


LONG = [pytest.param(*case, marks=pytest.mark.long) for case in (("biped", MANY), ("ugv", 5))]


@pytest.mark.parametrize(("name", "count"), [("toy", 5), *LONG])
def test_one_seed_is_one_sequence_of_episodes_in_every_adapter(name, count):
    found = rows_of(name, count)
    first, close = found["Gymnasium"], CLOSE[name]
    assert len(first) >= STEPS + 2  # some episodes ended
    for adapter, rows in found.items():
        np.testing.assert_allclose(rows, first, rtol=close, atol=close, err_msg=adapter)
    for n in (1, count) if HAS_SB3 else ():
        assert found[f"vector of {n}"].tobytes() == found[f"SB3 of {n}"].tobytes()


@pytest.mark.long
def test_two_processes_step_the_same_episodes_bit_by_bit():
    code = "from tests.fuzz.test_same_episode import digests; print(digests())"
    words = [sys.executable, "-c", code]
    more: dict[str, Any] = {"cwd": Path(__file__).parents[2], "text": True, "check": True}
    runs = [subprocess.run(words, capture_output=True, **more).stdout for _ in range(2)]
    assert runs[0] == runs[1]
    assert len(runs[0]) > 64
