"""Environment steps per second of every way to step ours, beside Gymnasium's own environments.

    python -m benchmarks.throughput [--quick] [--out FILE]

Each row is measured warm and blocks on its outputs; compile time stands apart. A core-second is one
of processor time, of all threads together: it does not depend on what else the machine does. "No
kernels" is the same program as XLA takes it, without `dynamics/fused.py`. Accuracy is measured in
the same run: the default environment's integrator against one sixteen times finer, over one second
of the same actions. Results go to a JSON file with machine, versions and commit; the table's last
column is each row's rate a core-second over that of the file's run before, on whatever machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from importlib.util import find_spec
from typing import Any, NamedTuple

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import markdown, options, provenance, read_json, write_json
from benchmarks.timing import without_kernels
from stickslip.dynamics.biped import RK4Split, simulate
from stickslip.envs import BipedEnv, UGVEnv, collect
from stickslip.envs.functional import pure_step
from stickslip.envs.registration import register

BATCHES = (1, 64, 1024, 8192)


class Row(NamedTuple):
    """One measurement: the median of several runs, with the fastest and slowest beside it; and the
    best rate a second of processor time."""

    interface: str
    environment: str
    batch: int
    steps_per_second: float
    slowest: float
    fastest: float
    per_core_second: float
    compile_seconds: float

    @property
    def name(self) -> tuple[str, str, int]:
        """What was measured."""
        return self.interface, self.environment, self.batch


class Rates(NamedTuple):
    """Steps per second of several runs, slowest first, and the best of processor time."""

    wall: list[float]
    processor: float


def actions_of(key, batch: int) -> jax.Array:
    """Random actions around a walking torque: 0.3 N m of noise, so that feet slip and stop."""
    return 0.04 + 0.075 * jax.random.normal(key, (batch, 1))


def leg_actions_of(key, batch: int) -> jax.Array:
    """Random moves of both legs, a fifth of what their rate allows: few drives end early."""
    return 0.2 * jax.random.normal(key, (batch, 2))


class Stepped(NamedTuple):
    """An environment that is stepped by vmap and scan, and its random actions(key, batch)."""

    name: str
    env: Any
    params: Any
    actions: Callable[[jax.Array, int], jax.Array]


def the_biped() -> Stepped:
    """As `BipedEnv` comes."""
    env = BipedEnv()
    return Stepped("stickslip/Biped-v0", env, env.default_params, actions_of)


def the_ugv(track: str) -> Stepped:
    """As `UGVEnv` comes, on a track by its name."""
    env = UGVEnv()
    params = env.make_params(track=track)
    return Stepped(f"stickslip/UGV-v0, {track}", env, params, leg_actions_of)


def scan_program(given: Stepped, batch: int, steps: int):
    """(compiled program, its first state, compile seconds): `steps` environment steps by vmap
    and scan, with fresh random actions and keys, observation, reward and autoreset."""
    env, params = given.env, jax.tree.map(jnp.asarray, given.params)

    def reset(key):
        return jax.vmap(env.reset_env, (0, None))(jax.random.split(key, batch), params)[1]

    def roll(state, key):
        def body(state, key):
            step_key, action_key = jax.random.split(key)
            out = jax.vmap(partial(pure_step, env), (0, 0, 0, None))(
                jax.random.split(step_key, batch), state, given.actions(action_key, batch), params
            )
            return out[1], (out[0].mean(), out[2].mean(), out[3].mean())

        return jax.lax.scan(body, state, jax.random.split(key, steps))

    state = jax.block_until_ready(jax.jit(reset)(jax.random.key(0)))
    begun = time.perf_counter()
    program = jax.jit(roll).lower(state, jax.random.key(1)).compile()
    return program, state, time.perf_counter() - begun


def functional_row(
    given: Stepped, batch: int, steps: int, repeats: int, kernels: bool = True
) -> Row:
    """By vmap and scan, in one thread of the caller's."""
    with nullcontext() if kernels else without_kernels():
        program, state, compile_seconds = scan_program(given, batch, steps)

    def run() -> None:
        jax.block_until_ready(program(state, jax.random.key(2)))

    rates = timed(run, batch * steps, repeats)
    name = "vmap + scan" if kernels else "vmap + scan, no kernels"
    return row(name, given.name, batch, rates, compile_seconds)


def noisy(torque: jax.Array, obs: jax.Array, key: jax.Array) -> jax.Array:
    """A policy that does not look: a walking torque with the noise of `actions_of`."""
    del obs
    return torque + 0.075 * jax.random.normal(key, (1,))


def collect_row(batch: int, steps: int, repeats: int) -> Row:
    """`collect` as it comes, on all cores; every run goes on where the one before ended."""
    env = BipedEnv()
    run_one = partial(collect, env, env.default_params, noisy, num_envs=batch, steps=steps)
    torque = jnp.full((1,), 0.04)
    begun = time.perf_counter()
    now = [jax.block_until_ready(run_one(policy_params=torque)).progress]
    first = time.perf_counter() - begun

    def run() -> None:
        found = jax.block_until_ready(run_one(policy_params=torque, progress=now[0]))
        now[0] = found.progress

    return row("collect", "stickslip/Biped-v0", batch, timed(run, batch * steps, repeats), first)


def single_row(name: str, steps: int, repeats: int, scale: float = 1.0) -> Row:
    """gymnasium.make(name), one environment, random actions drawn beforehand."""
    env, actions, first = _ready(partial(gymnasium.make, name), 256, scale)

    def run() -> None:
        env.reset()
        for index in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[index % 256])
            if terminated or truncated:
                env.reset()

    return row("gymnasium.make", name, 1, timed(run, steps, repeats), first)


def vector_row(name: str, mode: str, batch: int, steps: int, repeats: int, scale=1.0) -> Row:
    """gymnasium.make_vec(name), random actions drawn beforehand."""
    make = partial(gymnasium.make_vec, name, num_envs=batch, vectorization_mode=mode)
    env, actions, first = _ready(make, 32, scale)

    def run() -> None:
        for index in range(steps):
            env.step(actions[index % 32])

    return row(f"make_vec ({mode})", name, batch, timed(run, steps * batch, repeats), first)


def sb3_row(batch: int, steps: int, repeats: int) -> Row:
    """The SB3 VecEnv; random actions drawn beforehand."""
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    begun = time.perf_counter()
    env = SB3VecEnv(BipedEnv(), BipedEnv().default_params, batch)
    env.reset()
    draw = np.random.default_rng(0)
    actions = [
        np.clip(0.04 + 0.075 * draw.normal(size=(batch, 1)), -1, 1).astype(np.float32)
        for _ in range(32)
    ]
    env.step(actions[0])
    first = time.perf_counter() - begun

    def run() -> None:
        for index in range(steps):
            env.step(actions[index % 32])

    rates = timed(run, steps * batch, repeats)
    return row("SB3VecEnv", "stickslip/Biped-v0", batch, rates, first)


def accuracy() -> dict[str, float]:
    """Largest differences over one second between the default step and one sixteen times finer,
    with the exact inertia functions, in float32 and on slipping walks with random torques."""
    env = BipedEnv()
    params = env.default_params
    steps = 50
    torques = 4.0 * np.asarray(actions_of(jax.random.key(7), 64 * steps)).reshape(64, steps)
    state = env.reset(jax.random.key(0), params)[1].biped
    worst = {"crank_angle": 0.0, "foot_position": 0.0}
    for row_of_torques in torques[:16]:
        coarse = simulate(params.robot, params.scene, state, row_of_torques, 1.0, 0.02)
        fine = simulate(
            params.robot.bare,
            params.scene,
            state,
            row_of_torques,
            1.0,
            0.02,
            integrator=RK4Split(substeps=16),
        )
        valid = (coarse.contacts.status <= 1) & (fine.contacts.status <= 1)
        for name in worst:
            gap = jnp.abs(getattr(coarse.states, name) - getattr(fine.states, name))[1:]
            worst[name] = max(worst[name], float(jnp.max(jnp.where(valid, gap, 0.0))))
    return {f"{name}_error": value for name, value in worst.items()}


def timed(run: Callable[[], None], steps: int, repeats: int) -> Rates:
    """Steps per second of several warm runs."""
    run()
    rates, processor = [], []
    for _ in range(repeats):
        begun, used = time.perf_counter(), time.process_time()
        run()
        processor.append(steps / (time.process_time() - used))
        rates.append(steps / (time.perf_counter() - begun))
    return Rates(sorted(rates), max(processor))


def row(interface: str, name: str, batch: int, rates: Rates, compile_seconds: float) -> Row:
    """The median, slowest and fastest of some rates."""
    wall, median = rates.wall, float(np.median(rates.wall))
    return Row(interface, name, batch, median, wall[0], wall[-1], rates.processor, compile_seconds)


def rows(quick: bool) -> Iterator[Row]:
    """Every measurement, one at a time."""
    repeats, share = (3, 0.2) if quick else (7, 1.0)
    for batch in BATCHES:
        steps = max(10, int(share * min(2000, 400_000 // batch)))
        yield functional_row(the_biped(), batch, steps, repeats, kernels=False)
        yield functional_row(the_biped(), batch, steps, repeats)
        yield collect_row(batch, steps, repeats)
    count = int(share * 2000)
    yield single_row("stickslip/Biped-v0", count, repeats, scale=0.1)
    yield single_row("Pendulum-v1", 5 * count, repeats)
    yield single_row("CartPole-v1", 5 * count, repeats)
    for batch in (64, 256, 1024):
        steps = max(10, int(share * 300))
        yield vector_row(
            "stickslip/Biped-v0", "vector_entry_point", batch, steps, repeats, scale=0.1
        )
    yield vector_row("Pendulum-v1", "sync", 64, max(10, int(share * 200)), repeats)
    yield vector_row("CartPole-v1", "sync", 64, max(10, int(share * 200)), repeats)
    yield vector_row("CartPole-v1", "vector_entry_point", 1024, int(share * 300), repeats)
    for batch in (64, 256, 1024) if find_spec("stable_baselines3") else ():  # the extra sb3
        yield sb3_row(batch, max(10, int(share * 300)), repeats)
    for track in ("bump", "rough", "random-bump", "random-rough"):
        for kernels in (False, True):
            yield functional_row(the_ugv(track), 8192, max(10, int(share * 48)), repeats, kernels)
    yield single_row("stickslip/UGV-v0", count, repeats, scale=0.2)


def _ready(make: Callable[[], Any], draws: int, scale: float) -> tuple[Any, list[Any], float]:
    """An environment after its first step, random actions for it, and how long that took [s]."""
    begun = time.perf_counter()
    env = make()
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [_scaled(env.action_space.sample(), scale) for _ in range(draws)]
    env.step(actions[0])
    return env, actions, time.perf_counter() - begun


def _ratio(one: Row, before: float | None) -> str:
    return "" if before is None else f"{one.per_core_second / before:.2f}"


def _scaled(action: Any, scale: float) -> Any:
    return action if scale == 1.0 else (scale * action).astype(action.dtype)


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the table, write the JSON."""
    parser = options("throughput", __doc__)
    parser.add_argument("--quick", action="store_true", help="shorter runs, noisier numbers")
    given = parser.parse_args(arguments)
    register()
    before = {
        (one["interface"], one["environment"], one["batch"]): one.get("per_core_second")
        for one in read_json(given.out).get("rows", ())
    }
    measured = []
    for measurement in rows(given.quick):
        measured.append(measurement)
        print(
            f"{measurement.interface:28s} {measurement.environment:30s} "
            f"{measurement.batch:6d} {measurement.steps_per_second:12,.0f} steps/s",
            flush=True,
        )
    errors = accuracy()
    table = [
        {
            "interface": one.interface,
            "environment": one.environment,
            "batch": one.batch,
            "steps/s": f"{one.steps_per_second:,.0f}",
            "from": f"{one.slowest:,.0f}",
            "to": f"{one.fastest:,.0f}",
            "a core-second": f"{one.per_core_second:,.0f}",
            "compile [s]": f"{one.compile_seconds:.1f}",
            "to the run before": _ratio(one, before.get(one.name)),
        }
        for one in measured
    ]
    print("\n" + markdown(table))
    print(
        f"\nAfter one second of slipping, the default step differs by "
        f"{errors['crank_angle_error']:.1e} rad and {errors['foot_position_error']:.1e} m from one "
        "sixteen times finer with exact inertia functions."
    )
    content = {**provenance(), "rows": [one._asdict() for one in measured], "accuracy": errors}
    write_json(content, given.out)
    print(f"Written to {given.out}")


if __name__ == "__main__":
    main()
