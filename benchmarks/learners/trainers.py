"""The trainers of `stickslip train` for PPO: in JAX, and of Stable-Baselines3."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.learners.race import evaluations
from stickslip.agents.training.trainer import trainer_of

if TYPE_CHECKING:
    from benchmarks.learners.race import Race

STEPS = {"biped": 8_000_000, "ugv": 524_288}
"""Of a training in JAX, whose learning rate and noise follow a course."""


def ours(race: Race) -> None:
    """PPO in JAX with the defaults, the biped's noise ending at 0.03 as in benchmarks.training."""
    machine = race.task.machine
    noise = {"final_noise": 0.03} if machine == "biped" else {}
    _run(race, trainer="jax", timesteps=STEPS[machine], **noise)


def sb3_ppo(race: Race) -> None:
    """Stable-Baselines3's PPO with the defaults of `stickslip train --trainer sb3`."""
    _run(race, trainer="sb3")


def _run(race: Race, **given: Any) -> None:
    config = type(race.config).of(seed=race.seed, **given)
    race.start()
    trainer = trainer_of(config)(config, race.env, race.params, lambda _: None, lambda: False)
    try:
        trainer.begin_stretch(0)
        for goal in evaluations(config.timesteps, config.num_envs * config.ppo.rollout_steps):
            trainer.advance(goal)
            if race.tell(trainer.timesteps, trainer.policy()):
                return
    finally:
        trainer.close()
