"""Walks of many thousand calls, for what rounding adds up to."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import SUPPORT_START, BipedModel, BipedParams, BipedState, step
from stickslip.envs import BipedEnv

LONG_WALKS = {
    # what: (mu_static, mu_kinetic, crank rate at first, controller gain [N m s], held rate)
    "held at 3 rad/s, no slip": (1e6, 1e6, 3.0, 5.0, 3.0),
    "held loosely at 4 rad/s, slips each step": (0.06, 0.05, 3.0, 1.0, 4.0),
    "free crank, no slip": (1e6, 1e6, 12.0, 0.0, 0.0),
}


@jax.jit
def _long_walks(model, scenes, states, gains, wanted, size, count):
    def once(scene, state, gain, rate):
        return step(model, scene, state, gain * (rate - state.crank_rate), size)

    def body(_, now):
        states, worst, switches = now
        after, contact = jax.vmap(once)(scenes, states, gains, wanted)
        over = worst > Status.SLIP_ONSET
        after = jax.tree.map(lambda new, old: jnp.where(over, old, new), after, states)
        return after, jnp.maximum(worst, contact.status), switches + contact.switches

    none = jnp.zeros_like(states.steps)
    return jax.lax.fori_loop(0, count, body, (states, none, none))


def long_walks(
    model: BipedModel, calls: int, size: float = 0.005
) -> tuple[BipedState, np.ndarray, np.ndarray]:
    """The states after `calls` steps of LONG_WALKS, the gravest status and the switches.

    In the model's precision; its feet do not matter.
    """
    kind = jnp.asarray(model.total_mass).dtype
    mu_static, mu_kinetic, rate, gain, wanted = (
        jnp.asarray(column, kind) for column in zip(*LONG_WALKS.values(), strict=True)
    )
    zero = jnp.zeros_like(rate)
    phase = jnp.full_like(rate, SUPPORT_START)
    none = jnp.zeros(rate.shape, jnp.int32)
    states = BipedState(phase, none, rate, zero, zero, zero)
    scenes = replace(Scene.uniform(mu_static, mu_kinetic), outputs="state")
    numbers = gain, wanted, jnp.asarray(size, kind), jnp.asarray(calls)
    ended = _long_walks(model, scenes, states, *numbers)
    return jax.tree.map(np.asarray, ended)


def energy(model: BipedModel, states: BipedState) -> np.ndarray:
    """Kinetic and potential energy of feet at rest [J], by a model in double precision."""
    with jax.enable_x64(True):
        phases = jnp.asarray(np.asarray(states.phase, float))
        M = jax.vmap(lambda phase: model.inertia.at(phase).M)(phases)
        height = jax.vmap(lambda phase: model.inertia.moment_at(phase).Y)(phases)
        lifted = float(model.gravity) * np.asarray(height)
    return np.asarray(M) * np.asarray(states.crank_rate, float) ** 2 / 2 + lifted


def long_episode(dtype: str, calls: int, chunk: int = 1000) -> dict[str, tuple[float, float]]:
    """What an episode of so many control periods adds up to, and the same terms added exactly.

    The slippery floor, long feet, a crank held loosely at 4 rad/s. The exact slide is added up of
    steps that begin at foot position 0, which changes nothing else on a floor of one friction.
    """
    env = BipedEnv(autoreset="disabled")
    robot = BipedParams.from_bars(heel=1e6, toe=1e6, dtype=np.dtype(dtype))
    params = env.make_params(robot=robot, time_limit=1e9, dtype=np.dtype(dtype))
    period = float(np.dtype(dtype).type(params.control_period))

    @partial(jax.jit, static_argnums=1)
    def run(state, begins_at_0):
        def body(state, _):
            if begins_at_0:
                still = jnp.zeros_like(state.biped.foot_position)
                state = replace(state, biped=replace(state.biped, foot_position=still))
            action = jnp.clip((4.0 - state.biped.crank_rate[None]) / 4, -1, 1)
            _, after, reward, over, _, info = env.step_env(state, action, params)
            energy = info["positive_work"] + info["copper_loss"]
            slide = after.biped.foot_position
            return after, (reward, info["walked"], info["slid"], energy, slide, over)

        return jax.lax.scan(body, state, length=chunk)

    ends, terms = [], np.zeros(6)
    for begins_at_0 in (False, True):
        state, terms = env.reset(jax.random.key(0), params)[1], np.zeros(6)
        for _ in range(calls // chunk):
            state, found = run(state, begins_at_0)
            terms += [np.sum(np.asarray(one, np.float64)) for one in found]
        ends.append(state)
    if terms[5]:
        raise RuntimeError(f"the walk ended {terms[5]:.0f} periods before the last")
    state = ends[0]
    sums = state.totals
    turned = float(state.biped.phase) - SUPPORT_START + np.pi * int(state.biped.steps)
    found = (state.biped.time, sums.turned, sums.reward, sums.walked, sums.slid, sums.energy)
    exact = (calls // chunk * chunk * period, turned, *terms[:5])
    names = ("time [s]", "crank angle [rad]", "return [-]", "walked [m]", "slid [m]", "energy [J]")
    pairs = zip(map(float, (*found, state.biped.foot_position)), exact, strict=True)
    return dict(zip((*names, "foot_position [m]"), pairs, strict=True))
