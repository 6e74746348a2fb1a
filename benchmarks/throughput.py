"""Environment steps per second of every interface, beside Gymnasium's own environments.

    python -m benchmarks.throughput [--only PART ...] [--quick] [--update] [--out FILE]

Each row is measured warm and blocks on its outputs; compile time is separate. A core-second is one
of processor time, of all threads together. "No kernels" is the same program as XLA takes it.
Accuracy is measured in the same run: the default environment's integrator against one sixteen times
finer, over one second of the same actions. --update writes the table of docs/performance.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.vector.utils import batch_space

from benchmarks.report import markdown, measured_by_command, put_between, where
from benchmarks.timing import built, times_of, without_kernels
from stickslip.dynamics.biped import RK4Split, simulate
from stickslip.envs import BipedEnv, UGVEnv, collect
from stickslip.envs.functional import pure_step
from stickslip.envs.registration import register

BATCHES = (1, 64, 1024, 8192)
BIPED, UGV = "stickslip/Biped-v0", "stickslip/UGV-v0"
SCALES = {BIPED: 0.1, UGV: 0.2}
"""Size of the random actions of a loop of Python; else 1."""
PAGE = Path("docs/performance.md")


def rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Every measurement, one at a time."""
    repeats, share = (3, 0.2) if quick else (7, 1.0)
    for batch in BATCHES:
        steps = max(10, int(share * min(2000, 400_000 // batch)))
        env, size = BipedEnv(), (batch, steps, repeats)
        for kernels in (False, True):
            yield scanned(BIPED, env, env.default_params, biped_actions, *size, kernels)
        yield collected(*size)
    count, few = int(share * 2000), max(10, int(share * 300))
    for name, times in ((BIPED, 1), ("Pendulum-v1", 5), ("CartPole-v1", 5), (UGV, 1)):
        make, steps = partial(gymnasium.make, name), times * count
        yield looped("gymnasium.make", name, make, 1, steps, repeats)
    vectors = [(BIPED, "vector_entry_point", batch) for batch in (64, 256, 1024)]
    vectors += [(name, "sync", 64) for name in ("Pendulum-v1", "CartPole-v1")]
    vectors.append(("CartPole-v1", "vector_entry_point", 1024))
    for name, mode, batch in vectors:
        make = partial(gymnasium.make_vec, name, num_envs=batch, vectorization_mode=mode)
        yield looped(f"make_vec ({mode})", name, make, batch, few, repeats)
    if find_spec("stable_baselines3"):  # the extra sb3
        from stickslip.envs.adapters.sb3 import SB3VecEnv

        for batch in (64, 256, 1024):
            make = partial(SB3VecEnv, BipedEnv(), BipedEnv().default_params, batch)
            yield looped("SB3VecEnv", BIPED, make, batch, few, repeats)
    for track in ("bump", "rough", "random-bump", "random-rough"):
        env, size = UGVEnv(), (8192, max(10, int(share * 48)), repeats)
        params = env.make_params(track=track)
        for kernels in (False, True):
            yield scanned(f"{UGV}, {track}", env, params, ugv_actions, *size, kernels)


def biped_actions(key, batch: int) -> jax.Array:
    """Random actions around a walking torque: 0.3 N m of noise, so that feet slip and stop."""
    return 0.04 + 0.075 * jax.random.normal(key, (batch, 1))


def ugv_actions(key, batch: int) -> jax.Array:
    """Random moves of both legs, a fifth of what their rate allows."""
    return 0.2 * jax.random.normal(key, (batch, 2))


def scanned(name, env, params, actions, batch, steps, repeats, kernels) -> dict[str, Any]:
    """Steps per second by vmap and scan on one core, with all that an environment's step does."""
    params = jax.tree.map(jnp.asarray, params)

    def reset(key):
        return jax.vmap(env.reset_env, (0, None))(jax.random.split(key, batch), params)[1]

    def roll(state, key):
        def body(state, key):
            step_key, action_key = jax.random.split(key)
            out = jax.vmap(partial(pure_step, env), (0, 0, 0, None))(
                jax.random.split(step_key, batch), state, actions(action_key, batch), params
            )
            return out[1], (out[0].mean(), out[2].mean(), out[3].mean())

        return jax.lax.scan(body, state, jax.random.split(key, steps))

    with nullcontext() if kernels else without_kernels():
        state = jax.block_until_ready(jax.jit(reset)(jax.random.key(0)))
        program, compiling = built(roll, state, jax.random.key(1))
    interface = "vmap + scan" if kernels else "vmap + scan, no kernels"
    run = partial(program, state, jax.random.key(2))
    return row(interface, name, batch, batch * steps, run, repeats, compiling)


def collected(batch: int, steps: int, repeats: int) -> dict[str, Any]:
    """`collect` on all cores; every run goes on where the one before ended."""
    env, torque = BipedEnv(), jnp.full((1,), 0.04)

    def noisy(torque: jax.Array, _: jax.Array, key: jax.Array) -> jax.Array:
        return torque + 0.075 * jax.random.normal(key, (1,))

    run_one = partial(collect, env, env.default_params, noisy, num_envs=batch, steps=steps)
    begun = time.perf_counter()
    now = [jax.block_until_ready(run_one(policy_params=torque)).progress]
    first = time.perf_counter() - begun

    def run() -> None:
        found = jax.block_until_ready(run_one(policy_params=torque, progress=now[0]))
        now[0] = found.progress

    return row("collect", BIPED, batch, batch * steps, run, repeats, first)


def looped(
    interface: str, name: str, make: Callable[[], Any], batch: int, steps: int, repeats: int
) -> dict[str, Any]:
    """Steps of an interface in a loop of Python, random actions drawn beforehand."""
    begun = time.perf_counter()
    env = make()
    env.reset()
    alone = interface == "SB3VecEnv"  # its space is that of one environment
    space = batch_space(env.action_space, batch) if alone else env.action_space
    space.seed(0)
    drawn = [space.sample() for _ in range(256 if batch == 1 else 32)]
    actions = [(SCALES.get(name, 1.0) * one).astype(one.dtype) for one in drawn]
    env.step(actions[0])
    first = time.perf_counter() - begun

    def run() -> None:
        env.reset()
        for index in range(steps):
            found = env.step(actions[index % len(actions)])
            if batch == 1 and (found[2] or found[3]):
                env.reset()

    return row(interface, name, batch, steps * batch, run, repeats, first)


def row(interface, name, batch, steps, run, repeats, compiling) -> dict[str, Any]:
    """The median wall rate and the best rate of processor time, warm."""
    jax.block_until_ready(run())
    processor, wall = (steps / times_of(run, repeats).T).tolist()
    return {
        "interface": interface,
        "environment": name,
        "batch": batch,
        "steps_per_second": float(np.median(wall)),
        "per_core_second": max(processor),
        "compile_seconds": compiling,
    }


def accuracy(_: bool) -> Iterator[dict[str, float]]:
    """Largest differences over one second between the default step and one sixteen times finer
    with the exact inertia functions, in float32 and on slipping walks with random torques."""
    env = BipedEnv()
    params = env.default_params
    torques = 4.0 * np.asarray(biped_actions(jax.random.key(7), 64 * 50)).reshape(64, 50)
    state = env.reset(jax.random.key(0), params)[1].biped
    fine = RK4Split(substeps=16)
    worst = {"crank_angle": 0.0, "foot_position": 0.0}
    for one in torques[:16]:
        given = params.scene, state, one, 1.0, 0.02
        walks = simulate(params.robot, *given), simulate(params.robot.bare, *given, integrator=fine)
        valid = jnp.all(jnp.stack([walk.contacts.status <= 1 for walk in walks]), axis=0)
        for name in worst:
            first, second = (getattr(walk.states, name) for walk in walks)
            gap = jnp.where(valid, jnp.abs(first - second)[1:], 0.0)
            worst[name] = max(worst[name], float(jnp.max(gap)))
    yield {f"{name}_error": value for name, value in worst.items()}


def body(content: dict[str, Any]) -> str:
    """The table of the page."""
    lines = [
        {name: one[name] for name in ("interface", "environment", "batch")}
        | {
            "steps/s": f"{one['steps_per_second']:,.0f}",
            "a core-second": f"{one['per_core_second']:,.0f}",
            "compile [s]": f"{one['compile_seconds']:.1f}",
        }
        for one in content["rows"]
    ]
    (errors,) = content["accuracy"]
    return (
        f"{markdown(lines)}\n\nMeasured on {where(content, 'rows')}. After one second of slipping, "
        f"the default step differs by {errors['crank_angle_error']:.1e} rad and "
        f"{errors['foot_position_error']:.1e} m from one sixteen times finer with exact inertia "
        "functions."
    )


if __name__ == "__main__":
    register()
    parts = {"rows": rows, "accuracy": accuracy}
    measured_by_command("throughput", __doc__, parts, lambda now: put_between(PAGE, body(now)))
