"""The derivative of what a policy earns, through the simulator and by differences, by horizon.

A policy with three numbers (torque at all times, gain on the crank rate, part with the leg's angle)
walks from many starts. What it earns up to each horizon, in the mean over the starts, has a
derivative by the three numbers. Differences of that mean with the same starts tell it: the mean is
smooth even where single walks jump. The first-order estimate is the mean of the single walks'
derivatives; it is wrong where walks jump, since a jump has no derivative to either side. Falls are
such jumps, so both are also compared over the starts from which no walk has fallen.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.fused import fused
from stickslip.envs import BipedEnv, Randomisation

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

STARTS, STEPS = 4096, 96
NUMBERS = np.asarray([0.15, 0.3, 0.1], np.float32)
APART = 0.02
"""Half of the differences, in the three numbers."""
GROUPS = 16
"""Of starts, whose spread is the error of a mean."""
HORIZONS = (2, 4, 8, 16, 24, 32, 48, 64, 96)


class Ground(NamedTuple):
    """A floor, the one that its derivatives are to be right for, and the environment's substeps."""

    scene: Scene
    truth: str
    substeps: int = 1


GROUNDS = {
    "sticks (0.8, 0.6)": Ground(Scene.uniform(0.8, 0.6), "sticks (0.8, 0.6)"),
    "slips (0.06, 0.05)": Ground(Scene.uniform(0.06, 0.05), "slips (0.06, 0.05)"),
    "slips (0.05, 0.05)": Ground(Scene.uniform(0.05, 0.05), "slips (0.05, 0.05)"),
    "smoothed, 0.1 m/s": Ground(Scene.smoothed(0.05, 0.1), "slips (0.06, 0.05)"),
    "smoothed, 0.01 m/s": Ground(Scene.smoothed(0.05, 0.01), "slips (0.06, 0.05)", 4),
}


def acted(numbers: Float[Array, " 3"], obs: Float[Array, " obs"]) -> Float[Array, " 1"]:
    """The policy."""
    wanted, rate = obs[5], obs[2]
    seen = jnp.stack([jnp.ones_like(rate), (wanted - rate) / wanted, obs[1]])
    return jnp.tanh(numbers @ seen)[None]


def earned(
    env: BipedEnv, params: Any, key: Array, numbers: Float[Array, " 3"]
) -> tuple[Float[Array, " steps"], Bool[Array, " steps"]]:
    """What one walk earns up to each step, nothing once it has ended, and whether it goes on."""

    def step(carry: Any, _: None):
        obs, state, total, going = carry
        found = run_step(env, state, acted(numbers, obs), params)
        obs, after, reward, terminated, truncated = found
        total = total + jnp.where(going, reward, 0.0)
        state = jax.tree.map(partial(jnp.where, going), after, state)
        going = going & ~(terminated | truncated)
        return (obs, state, total, going), (total, going)

    obs, state = env.reset_env(key, params)
    start = obs, state, jnp.zeros(()), jnp.ones((), bool)
    return jax.lax.scan(step, start, None, length=STEPS)[1]


@partial(fused, fixed=1)
def run_step(env: BipedEnv, state: Any, action: Array, params: Any):
    """A step without its info."""
    return env.step_env(state, action, params)[:5]


@partial(jax.jit, static_argnums=0)
def _values(env: BipedEnv, params: Any, keys: Array, numbers: Array) -> tuple[Array, Array]:
    return jax.vmap(lambda key: earned(env, params, key, numbers))(keys)


@partial(jax.jit, static_argnums=0)
def _slopes(env: BipedEnv, params: Any, keys: Array, numbers: Array) -> tuple[Array, Array]:
    """[starts, steps, 3] and [starts, steps], in blocks that fit into a cache."""

    def one(key: Array) -> tuple[Array, Array]:
        walk = partial(earned, env, params, key)
        return jax.jacfwd(walk, has_aux=True)(numbers)

    return jax.lax.map(one, keys, batch_size=256)


def measure(name: str) -> dict[str, Any]:
    """Of a floor: both derivatives by horizon, over all starts and over those without a fall."""
    ground = GROUNDS[name]
    env = BipedEnv(autoreset="disabled", substeps=ground.substeps)
    drawn = Randomisation(phase=(np.pi / 2, 3 * np.pi / 2), crank_rate=(0.0, 5.0))
    params = env.make_params(scene=ground.scene, randomisation=drawn)
    keys = jax.random.split(jax.random.key(0), STARTS)
    at = np.asarray(HORIZONS) - 1
    slopes, upright = (np.asarray(one)[:, at] for one in _slopes(env, params, keys, NUMBERS))
    apart = []
    for index in range(3):
        moved = np.zeros(3, np.float32)
        moved[index] = APART
        ends = [_values(env, params, keys, NUMBERS + sign * moved) for sign in (1, -1)]
        (up, one), (down, other) = [[np.asarray(part)[:, at] for part in end] for end in ends]
        apart.append((up - down) / (2 * APART))
        upright = upright & one & other
    differences = np.stack(apart, -1)
    return {
        "all": _both(slopes, differences, np.ones_like(upright)),
        "upright": _both(slopes, differences, upright),
        "share_upright": upright.mean(0).round(4).tolist(),
        "not_finite": int((~np.isfinite(slopes)).any((1, 2)).sum()),
    }


def _both(slopes: np.ndarray, differences: np.ndarray, counted: np.ndarray) -> dict[str, Any]:
    """Both estimates from the starts that count, [starts, horizons]."""
    return {"first": _of(slopes, counted), "differences": _of(differences, counted)}


def _of(values: np.ndarray, counted: np.ndarray) -> dict[str, Any]:
    """Mean and its standard error [horizons, 3]; spread of single walks', the root of the sum of
    variances over the three numbers, and the largest [horizons]."""
    means, errors, spreads, largest = [], [], [], []
    for place in range(values.shape[1]):
        own = values[counted[:, place], place].astype(np.float64)
        groups = np.array_split(own, GROUPS)
        middle = np.asarray([group.mean(0) for group in groups])
        means.append(own.mean(0).round(6).tolist())
        errors.append((middle.std(0, ddof=1) / np.sqrt(GROUPS)).round(6).tolist())
        spreads.append(round(float(np.sqrt(own.var(0).sum())), 6))
        largest.append(round(float(np.abs(own).max()), 4))
    return {"mean": means, "error": errors, "spread": spreads, "largest": largest}
