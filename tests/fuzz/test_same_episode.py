"""One seed, one sequence of episodes: in every adapter, two processes, batches of 1, 5 and 1000.

Run with -s for what docs/reliability.md quotes.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv, GymEnv, GymVectorEnv, Randomisation
from tests.fuzz.environments import HAS_SB3

SEED, MANY, STEPS, CHOSEN = 7, 1000, 40, 3
OPTIONS = {
    "scene": Scene.uniform(0.06, 0.05),
    "time_limit": 0.6,
    "randomisation": Randomisation(friction=(0.5, 2.0), mass=(0.8, 1.2), crank_rate=(-1.0, 3.0)),
}
ACTIONS = np.random.default_rng(2).uniform(-1, 1, (STEPS, MANY, 1)).astype(np.float32)


def environment(autoreset: str):
    env = BipedEnv(autoreset=autoreset)
    return env, env.make_params(**OPTIONS)


def by_functional() -> np.ndarray:
    """Environment CHOSEN of the batch, alone, by the functions themselves."""
    env, params = environment("disabled")
    chain = jax.random.key(SEED + CHOSEN)
    rows, state, over = [], None, True
    for step in range(STEPS):
        if over:
            chain, key = jax.random.split(chain)
            obs, state = env.reset(key, params)
            rows.append(np.append(obs, 0.0))
        action = jnp.asarray(ACTIONS[step, CHOSEN])
        obs, state, reward, terminated, truncated, _ = env.step(key, state, action, params)
        rows.append(np.append(obs, reward))
        over = bool(terminated) or bool(truncated)
    return np.asarray(rows, np.float32)


def by_single() -> np.ndarray:
    env = GymEnv(*environment("disabled"))
    obs, _ = env.reset(seed=SEED + CHOSEN)
    rows = [np.append(obs, 0.0)]
    for step in range(STEPS):
        obs, reward, terminated, truncated, _ = env.step(ACTIONS[step, CHOSEN])
        rows.append(np.append(obs, reward))
        if (terminated or truncated) and step < STEPS - 1:
            rows.append(np.append(env.reset()[0], 0.0))
    return np.asarray(rows, np.float32)


def by_vector(count: int) -> np.ndarray:
    env = GymVectorEnv(*environment("same_step"), count, "same_step")
    first, at = (SEED, CHOSEN) if count > 1 else (SEED + CHOSEN, 0)
    obs, _ = env.reset(seed=first)
    rows = [np.append(obs[at], 0.0)]
    for step in range(STEPS):
        actions = ACTIONS[step, :count] if count > 1 else ACTIONS[step, CHOSEN : CHOSEN + 1]
        obs, reward, terminated, truncated, infos = env.step(actions)
        over = terminated[at] or truncated[at]
        last = infos["final_obs"][at] if over else obs[at]
        rows.append(np.append(last, reward[at]))
        if over and step < STEPS - 1:
            rows.append(np.append(obs[at], 0.0))
    return np.asarray(rows, np.float32)


def by_sb3(count: int) -> np.ndarray:
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    first, at = (SEED, CHOSEN) if count > 1 else (SEED + CHOSEN, 0)
    env = SB3VecEnv(*environment("same_step"), count, seed=first)
    rows = [np.append(env.reset()[at], 0.0)]
    for step in range(STEPS):
        actions = ACTIONS[step, :count] if count > 1 else ACTIONS[step, CHOSEN : CHOSEN + 1]
        obs, reward, over, infos = env.step(actions)
        last = infos[at]["terminal_observation"] if over[at] else obs[at]
        rows.append(np.append(last, reward[at]))
        if over[at] and step < STEPS - 1:
            rows.append(np.append(obs[at], 0.0))
    return np.asarray(rows, np.float32)


def ways(count: int) -> dict[str, Callable[[], np.ndarray]]:
    """Each adapter, batches alone and of `count`."""
    found = {"functional": by_functional, "Gymnasium": by_single}
    for name, way in {"vector": by_vector, "SB3": by_sb3}.items():
        if name != "SB3" or HAS_SB3:
            found |= {f"{name} of {n}": partial(way, n) for n in (1, count)}
    return found


def digests() -> dict[str, str]:
    rows = {name: way() for name, way in ways(MANY).items()}
    return {name: hashlib.sha256(one.tobytes()).hexdigest() for name, one in rows.items()}


@pytest.mark.parametrize("count", [5, pytest.param(MANY, marks=pytest.mark.long)])
def test_one_seed_is_one_sequence_of_episodes_in_every_adapter(count):
    found = {name: way() for name, way in ways(count).items()}
    first = found["Gymnasium"]
    assert len(first) > STEPS + 2  # some episodes ended
    for name, rows in found.items():
        assert rows.shape == first.shape, name
        most = np.abs(rows - first).max()
        print(f"\n{name}: bitwise {rows.tobytes() == first.tobytes()}, differs by {most:.1e}")
        np.testing.assert_allclose(rows, first, rtol=1e-5, atol=1e-5, err_msg=name)
    for n in (1, count) if HAS_SB3 else ():
        assert found[f"vector of {n}"].tobytes() == found[f"SB3 of {n}"].tobytes()


@pytest.mark.long
def test_two_processes_step_the_same_episodes_bit_by_bit():
    code = "from tests.fuzz.test_same_episode import digests; print(digests())"
    root = Path(__file__).parents[2]
    runs = [
        subprocess.run(
            [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
        )
        for _ in range(2)
    ]
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout) > 64
