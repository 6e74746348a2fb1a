"""Sampling model predictive control: the environment is its own model, a policy the first guess.

`pip install stickslip`, then `python sampling_mpc.py [STEPS] [TASK] [POLICY]`.

In each control step it plays SAMPLES futures of AHEAD steps with noise, linear between knots: half
of them around the last plan, half around the policy, which plays TAIL steps more. The first action
of the best one is taken. STEPS counts all that are simulated. It sees the state and all that the
reset drew, and the floor ahead: it plans an episode that it knows, as no learner can.
"""

import sys
from dataclasses import field

import jax
import jax.numpy as jnp

from stickslip.agents import MLPPolicy, evaluate_task, load_policy
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.envs import FunctionalEnv, known_of, task_by_name

STEPS = int(sys.argv[1]) if sys.argv[1:] else 102_400_000
TASK = task_by_name(sys.argv[2] if sys.argv[2:] else "BipedIce-v0")
POLICY = load_policy(sys.argv[3] if sys.argv[3:] else "biped-ice")
AHEAD, TAIL, KNOT, NOISE = 30, 20, 5, 0.3
EPISODES = known_of(TASK).episodes
SAMPLES = max(2, STEPS // (EPISODES * TASK.max_episode_steps * (AHEAD + TAIL)))


@pytree_dataclass
class SamplingMPC:
    """The controller. It remembers its plan, what the policy remembers, and a random key."""

    policy: MLPPolicy
    env: FunctionalEnv = field(metadata={"static": True})

    def validate(self):
        return self

    def init(self, params, state):
        plan = jnp.zeros((AHEAD, len(self.env.action_names)))
        return plan, self.policy.init(params, state), jax.random.key_data(jax.random.key(0))

    def act(self, memory, obs, state, params):
        plan, held, key = memory
        key, now = jax.random.split(jax.random.wrap_key_data(key))
        noise = jax.random.normal(now, (SAMPLES, AHEAD // KNOT + 1, plan.shape[1]))
        noise *= NOISE * jnp.where(jnp.arange(SAMPLES) % 2, 1.0, 0.25)[:, None, None]
        noise = jax.image.resize(noise, (SAMPLES, *plan.shape), "linear")
        noise = noise.at[0].set(0).at[-1].set(0)  # the plan and the policy themselves
        earned, acts = jax.vmap(self.future, (0, 0, None, None, None, None, None))(
            noise, jnp.arange(SAMPLES) < SAMPLES // 2, plan, held, obs, state, params
        )
        best = acts[jnp.argmax(earned)]
        held = self.policy.act(held, obs, state, params)[0]
        return (best[1 : AHEAD + 1], held, jax.random.key_data(key)), best[0]

    def future(self, noise, around_plan, plan, held, obs, state, params):
        """Return and actions of a future, around the plan or around the policy."""

        def step(now, given):
            obs, state, held, over = now
            plan, noise, tail = given
            held, action = self.policy.act(held, obs, state, params)
            tried = jnp.clip(jnp.where(around_plan, plan, action) + noise, -1, 1)
            action = jnp.where(tail, action, tried)
            obs, state, reward, failed, done, _ = self.env.step_env(state, action, params)
            return (obs, state, held, over | failed | done), (jnp.where(over, 0, reward), action)

        plan, noise = (jnp.pad(one, ((0, TAIL), (0, 0))) for one in (plan, noise))
        tails = jnp.arange(AHEAD + TAIL) >= AHEAD
        begun = obs, state, held, jnp.asarray(False)
        rewards, acts = jax.lax.scan(step, begun, (plan, noise, tails))[1]
        return rewards.sum(), acts


who = {"policy": POLICY, "planned": SamplingMPC(POLICY, TASK.make("disabled")[0])}
found = evaluate_task(TASK.name, who)
for name in who:
    print(f"{name}: return {found.row(TASK.name, name).metrics['return'].value:.4g}")
print(f"score {found.row(TASK.name, 'planned').metrics['task_score'].value:.3f}")
