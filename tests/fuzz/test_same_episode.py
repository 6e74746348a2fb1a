"""One seed, one sequence of episodes: in every adapter, two processes, batches of 1, 5 and 1000.

Run with -s for what docs/performance.md quotes.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv, GymEnv, GymVectorEnv, Randomisation
from tests.envs.ugv import helpers as ugv
from tests.fuzz.test_constructors import HAS_SB3

SEED, MANY, STEPS, CHOSEN = 7, 1000, 40, 3
OPTIONS = {
    "scene": Scene.uniform(0.06, 0.05),
    "time_limit": 0.6,
    "randomisation": Randomisation(friction=(0.5, 2.0), mass=(0.8, 1.2), crank_rate=(-1.0, 3.0)),
}
DRAWN = np.random.default_rng(2).uniform(-1, 1, (STEPS, MANY, 2)).astype(np.float32)


class Episodes(NamedTuple):
    """Observations and rewards of environment CHOSEN of a batch, stepped by each adapter."""

    machine: str

    def environment(self, autoreset: str):
        if self.machine == "ugv":
            return ugv.task("random", autoreset=autoreset, preview=3)
        env = BipedEnv(autoreset=autoreset)
        return env, env.make_params(**OPTIONS)

    @property
    def actions(self) -> np.ndarray:
        return 0.5 * DRAWN if self.machine == "ugv" else DRAWN[..., :1]

    def by_functional(self) -> np.ndarray:
        """Environment CHOSEN of the batch, alone, by the functions themselves."""
        env, params = self.environment("disabled")
        chain = jax.random.key(SEED + CHOSEN)
        rows, state, over = [], None, True
        for step in range(STEPS):
            if over:
                chain, key = jax.random.split(chain)
                obs, state = env.reset(key, params)
                rows.append(np.append(obs, 0.0))
            action = jnp.asarray(self.actions[step, CHOSEN])
            obs, state, reward, terminated, truncated, _ = env.step(key, state, action, params)
            rows.append(np.append(obs, reward))
            over = bool(terminated) or bool(truncated)
        return np.asarray(rows, np.float32)

    def by_single(self) -> np.ndarray:
        env = GymEnv(*self.environment("disabled"))
        obs, _ = env.reset(seed=SEED + CHOSEN)
        rows = [np.append(obs, 0.0)]
        for step in range(STEPS):
            obs, reward, terminated, truncated, _ = env.step(self.actions[step, CHOSEN])
            rows.append(np.append(obs, reward))
            if (terminated or truncated) and step < STEPS - 1:
                rows.append(np.append(env.reset()[0], 0.0))
        return np.asarray(rows, np.float32)

    def batch(self, count: int) -> tuple[int, int, np.ndarray]:
        """First seed of a batch, place of CHOSEN in it, and actions."""
        if count == 1:
            return SEED + CHOSEN, 0, self.actions[:, CHOSEN : CHOSEN + 1]
        return SEED, CHOSEN, self.actions[:, :count]

    def by_vector(self, count: int) -> np.ndarray:
        env = GymVectorEnv(*self.environment("same_step"), count, "same_step")
        first, at, actions = self.batch(count)
        obs, _ = env.reset(seed=first)
        rows = [np.append(obs[at], 0.0)]
        for step in range(STEPS):
            obs, reward, terminated, truncated, infos = env.step(actions[step])
            over = terminated[at] or truncated[at]
            last = infos["final_obs"][at] if over else obs[at]
            rows.append(np.append(last, reward[at]))
            if over and step < STEPS - 1:
                rows.append(np.append(obs[at], 0.0))
        return np.asarray(rows, np.float32)

    def by_sb3(self, count: int) -> np.ndarray:
        from stickslip.envs.adapters.sb3 import SB3VecEnv

        first, at, actions = self.batch(count)
        env = SB3VecEnv(*self.environment("same_step"), count, seed=first)
        rows = [np.append(env.reset()[at], 0.0)]
        for step in range(STEPS):
            obs, reward, over, infos = env.step(actions[step])
            last = infos[at]["terminal_observation"] if over[at] else obs[at]
            rows.append(np.append(last, reward[at]))
            if over[at] and step < STEPS - 1:
                rows.append(np.append(obs[at], 0.0))
        return np.asarray(rows, np.float32)


def ways(count: int, machine: str = "biped") -> dict[str, Callable[[], np.ndarray]]:
    """Each adapter, batches alone and of `count`."""
    of = Episodes(machine)
    found = {"functional": of.by_functional, "Gymnasium": of.by_single}
    for name, way in {"vector": of.by_vector, "SB3": of.by_sb3}.items():
        if name != "SB3" or HAS_SB3:
            found |= {f"{name} of {n}": partial(way, n) for n in (1, count)}
    return found


def digests() -> dict[str, str]:
    rows = {name: way() for name, way in ways(MANY).items()}
    return {name: hashlib.sha256(one.tobytes()).hexdigest() for name, one in rows.items()}


LONG = [pytest.param("biped", MANY, marks=pytest.mark.long)]
LONG += [pytest.param("ugv", 5, marks=pytest.mark.long)]


@pytest.mark.parametrize(("machine", "count"), [("biped", 5), *LONG])
def test_one_seed_is_one_sequence_of_episodes_in_every_adapter(machine, count):
    found = {name: way() for name, way in ways(count, machine).items()}
    first, close = found["Gymnasium"], 1e-5 if machine == "biped" else 2e-3
    assert len(first) >= STEPS + 2  # some episodes ended
    for name, rows in found.items():
        assert rows.shape == first.shape, name
        most = np.abs(rows - first).max()
        print(f"\n{name}: bitwise {rows.tobytes() == first.tobytes()}, differs by {most:.1e}")
        np.testing.assert_allclose(rows, first, rtol=close, atol=close, err_msg=name)
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
