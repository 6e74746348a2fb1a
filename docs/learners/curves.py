"""Learning curves of SAC, SNES and analytic policy gradients beside PPO's, on core and hard tasks.

    pip install "stickslip[train,sbx]" evosax
    python -m docs.learners.curves [--only LEARNER] [--tasks NAME ...] [--out FILE]
    python -m docs.learners.curves --redraw

SAC and SNES have the training episodes that PPO has in `benchmarks.training`. Every learner has
SECONDS of processor time for each of SEEDS, compiling and evaluations aside: an update counts as
thrice the median one at most. What it plays after each of POINTS parts are the test episodes:
nothing is chosen by them.
"""

import itertools
import sys
import time
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import RESULTS, options, provenance, read_json, where, write_json
from benchmarks.tasks import EPISODES, rounded
from benchmarks.training import configuration
from docs.learners.policy_gradient import PolicyGradient
from stickslip.agents import MLPPolicy
from stickslip.agents.evaluation.rollout import is_random, play, without_resets
from stickslip.agents.evaluation.table import keep_of
from stickslip.agents.machine import machine_by_name
from stickslip.envs import TASKS, collect, known_of
from stickslip.envs.functional import horizon
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import LEVEL, make_sheet, name_panel, save_sheet, styled

SECONDS, POINTS, SEEDS = 40.0, 10, (0, 1, 2)
EPISODES_EACH = {"biped": 32, "ugv": 4}
"""Environments in which SNES tries each candidate."""
FILE, FOLDER = RESULTS / "curves.json", Path("docs/learners")
SHOWN = {
    "PPO": "PPO, 5 seeds",
    "SAC": "SAC",
    "SNES": "SNES of a linear policy",
    "gradient": "analytic policy gradients",
}


class SAC:
    """SAC of sbx: 32 environments, a gradient step for four steps."""

    def __init__(self, config, env, params, seed, before):
        import sbx

        from stickslip.envs import SB3VecEnv

        width = len(env.observation_bounds(params)[0])
        self.unscaled = jnp.zeros(width), jnp.ones(width)
        self.model = sbx.SAC(
            "MlpPolicy",
            SB3VecEnv(env, params, num_envs=32),
            learning_rate=1e-3,
            learning_starts=2_000,
            gradient_steps=8,
            gamma=config.discount,
            policy_kwargs={"net_arch": [64, 64]},
            seed=seed,
        )
        self.advance()  # nothing is learnt yet

    @property
    def steps(self):
        return self.model.num_timesteps

    def advance(self):
        self.model.learn(32 * 32, reset_num_timesteps=False)

    def policy(self):
        actor = self.model.policy.actor_state.params["params"]
        layers = [actor[f"Dense_{i}"] for i in range(3)]
        weights, biases = (
            tuple(jnp.asarray(one[name]) for one in layers) for name in ("kernel", "bias")
        )
        return MLPPolicy(weights, biases, *self.unscaled, activation="relu", squash="tanh")


@partial(jax.jit, static_argnums=(0, 1, 2))
def costs(env, count, steps, params, tried, key):
    """Minus the mean return of environments under each candidate, a linear policy."""
    act = lambda weights, obs, key: jnp.tanh(obs @ weights[:-1] + weights[-1])  # noqa: E731

    def one(weights):
        found = collect(env, params, act, key, num_envs=count, steps=steps, policy_params=weights)
        return -found.reward.sum() / count

    return jax.lax.map(one, tried, batch_size=8)


class SNES:
    """SNES of evosax: 64 candidates, each as long as an episode in EPISODES_EACH environments."""

    def __init__(self, config, env, params, seed, before):
        from evosax import algorithms

        shape = len(env.observation_bounds(params)[0]) + 1, len(env.action_names)
        self.search, self.key = algorithms.SNES(64, jnp.zeros(shape)), jax.random.key(seed)
        self.chosen = self.search.default_params.replace(std_init=0.3)
        self.state = self.search.init(self.key, jnp.zeros(shape), self.chosen)
        self.params, self.steps = params, 0
        self.sizes = EPISODES_EACH[TASKS[config.task].machine], horizon(params)
        self.costs = partial(costs, env, *self.sizes)

    def advance(self):
        self.key, key = jax.random.split(self.key)
        tried, self.state = self.search.ask(key, self.state, self.chosen)
        found = self.costs(self.params, tried, key)
        self.state, _ = self.search.tell(key, tried, found, self.state, self.chosen)
        self.steps += 64 * self.sizes[0] * self.sizes[1]

    def policy(self):
        mean = jnp.asarray(self.search.get_mean(self.state))
        unscaled = jnp.zeros(len(mean) - 1), jnp.ones(len(mean) - 1)
        return MLPPolicy((mean[:-1],), (mean[-1],), *unscaled, squash="tanh")


def gradient(config, env, params, seed, before):
    """The analytic policy gradient, compiled once."""
    before = before or PolicyGradient(TASKS[config.task])
    before.begin(seed)
    return before


LEARNERS = {"SAC": SAC, "SNES": SNES, "gradient": gradient}


def measure(task, make):
    """Steps, processor time and mean return in the test episodes, of each seed along its way."""
    config = configuration(task)
    env, training, params, _ = machine_by_name(task.machine).training_task(config)
    test, seen = without_resets(env), range(EPISODES[task.machine] if is_random(env, params) else 1)

    def earned(learner):
        return rounded(float(play(test, learner.policy(), params, seen, keep_of).reward.mean()))

    learner, found = None, {"digest": task.digest, "steps": [], "processor_seconds": []}
    found["returns"] = []
    for seed in SEEDS:
        learner = make(config, env, training, seed, learner)
        rows, took, spent = [], [], 0.0
        for part in range(1, POINTS + 1):
            while spent < SECONDS * part / POINTS or len(took) < 5:
                begun = time.process_time()
                learner.advance()
                jax.block_until_ready(jax.tree.leaves(learner.policy()))
                took.append(time.process_time() - begun)
                spent = np.minimum(took, 3 * np.median(took)).sum()
            rows.append((learner.steps, round(float(spent), 2), earned(learner)))
        for name, column in zip(list(found)[1:], zip(*rows, strict=True), strict=True):
            found[name].append(list(column))
        print(f"  seed {seed}: {learner.steps:,} steps, {rows[-1][-1]:.4g}", flush=True)
    return found


def of_task(content, name):
    """Steps, processor time [s] and scores [seeds, points] of each learner, PPO first."""
    scale, found = known_of(TASKS[name]).scale, {}
    entries = {
        "PPO": read_json(RESULTS / "training.json")["tasks"][name],
        **content["curves"][name],
    }
    for learner, entry in entries.items():
        scores = scale.score(np.asarray(entry["returns"], float))
        axes = (np.atleast_2d(entry[axis]) for axis in ("steps", "processor_seconds"))
        found[learner] = *(axis.mean(0) for axis in axes), scores
    return found


@styled
def draw(content, machine):
    """A machine's tasks: two panels each, the score over steps and over processor time."""
    names = [one for one in TASKS if TASKS[one].machine == machine and one in content["curves"]]
    rows = -(-len(names) // 2)
    figure, axes = make_sheet(rows, 4, (12.0, 1.75 * rows + 0.6), sharex=False)
    for place, name in enumerate(names):
        pair = axes[2 * place : 2 * place + 2]
        for learner, (*across, scores) in of_task(content, name).items():
            colour = theme.PLAYERS[list(SHOWN).index(learner)]
            for axis, at in zip(pair, across, strict=True):
                axis.plot(at, np.median(scores, 0), color=colour, label=SHOWN[learner])
                band = scores.min(0), scores.max(0)
                axis.fill_between(at, *band, color=colour, alpha=0.15, lw=0)
        known = known_of(TASKS[name])
        for axis in pair:
            axis.axhline(known.scale.score(known.by_hand.value), **LEVEL)
            axis.set(ylim=(-0.5, 1.05))
        pair[0].set_xscale("log")
        pair[1].set_xlim(0, SECONDS)
        name_panel(pair[0], f"score, {name}", below="environment steps")
        name_panel(pair[1], "", below="processor time [s]")
    for axis in axes[2 * len(names) :]:
        axis.remove()
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return save_sheet(figure, FOLDER / f"{machine}.png")


def main(arguments):
    """Measure what is missing, or draw."""
    unsolved = [name for name, task in TASKS.items() if task.tier != "check"]
    parser = options("curves", __doc__, FILE)
    parser.prog = "python -m docs.learners.curves"
    parser.add_argument("--only", nargs="+", choices=LEARNERS, default=list(LEARNERS))
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=unsolved, metavar="NAME")
    parser.add_argument("--redraw", action="store_true")
    given = parser.parse_args(arguments)
    content = read_json(given.out) if given.out.exists() else provenance() | {"curves": {}}
    if given.redraw:
        pictures = [draw(content, machine) for machine in ("biped", "ugv")]
        print(f"Written: {', '.join(map(str, pictures))}; measured on {where(content)}")
        return
    for name, learner in itertools.product(given.tasks, given.only):
        task, entries = TASKS[name], content["curves"].setdefault(name, {})
        unfit = task.cost_limit is not None or (learner == "gradient" and task.machine == "biped")
        if not unfit and entries.get(learner, {}).get("digest") != task.digest:
            print(f"{name}, {learner}", flush=True)
            entries[learner] = measure(task, LEARNERS[learner])
            write_json(content, given.out)


if __name__ == "__main__":
    main(sys.argv[1:])
