"""PPO with the default learning settings on a task."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.tasks.measure import EPISODES, rounded
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import is_random, play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.registry import machine_by_name
from stickslip.agents.training.trainer import trainer_of
from stickslip.agents.ugv.names import USUAL

if TYPE_CHECKING:
    from stickslip.envs import TaskDefinition

FAILURE = 10.0
"""Penalty of a failure in the scaled reward that the UGV trains on, as in `stickslip train`."""


def learn(task: TaskDefinition, seeds: int, steps: int) -> dict[str, Any]:
    """The mean return of each seed's last policy over the task's episodes."""
    returns = [_trained(task, seed, steps) for seed in range(seeds)]
    scaled = ", rewards scaled" if task.machine == "ugv" else ""
    how = f"PPO, default learning settings, on the task itself{scaled}, {steps:,} steps"
    return {"how": how, "returns": returns}


def training_params(task: TaskDefinition, params: Any) -> Any:
    """The task's parameters with the UGV's rewards scaled, as `stickslip train` scales them."""
    if task.machine != "ugv":
        return params
    scale = 1 / USUAL[str(task.choices["criterion"])]
    return params.replace(reward_scale=scale, failure_penalty=FAILURE / scale)


def _trained(task: TaskDefinition, seed: int, steps: int) -> float:
    env, params = task.make("same_step")
    machine = machine_by_name(task.machine)
    config = machine.configuration.of(seed=seed, timesteps=steps)
    kind = trainer_of(config)
    trainer = kind(config, env, training_params(task, params), lambda update: None, lambda: False)
    try:
        trainer.begin_stretch(0)
        trainer.advance(steps)
        policy = trainer.policy()
    finally:
        trainer.close()
    seen = range(EPISODES[task.machine] if is_random(params) else 1)
    played = play(without_resets(env), policy, params, seen, keep_of)
    found = rounded(float(played.reward.mean()))
    print(f"{task.name}: PPO, seed {seed}: {found}", flush=True)
    return found
