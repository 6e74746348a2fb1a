"""With which settings and seeds the policies of the package are trained."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.agents.registry import machine_by_name

if TYPE_CHECKING:
    from stickslip.agents.training.groups import LearningConfiguration
    from stickslip.envs import TaskDefinition


class Recipe(NamedTuple):
    """settings: of `stickslip train`, beside the task. seeds: those tried, of which the one of the
    best evaluation is kept."""

    settings: dict[str, Any]
    seeds: tuple[int, ...] = (0,)


def walking(fastest: float, **others: Any) -> dict[str, Any]:
    """Short training episodes from any phase and up to this crank rate, which fear slips and falls
    less than the task does: otherwise standing still is learnt."""
    usual = {"episode_time": 1.5, "slip_weight": 3.0, "fall_penalty": 1.0}
    return {"start_rate": fastest} | usual | others


DRIVING: dict[str, Any] = {
    "failure": 10.0,
    "noise": 0.5,
    "final_noise": 0.05,
    "discount": 0.99,
    "random_start": (30.0, 150.0),
    "timesteps": 1_000_000,
}
"""From any leg angles: begun with straight legs alone, training ends in the next local optimum."""
ON_ICE = {"start_rate": 8.0, "slip_weight": 3.0, "fall_penalty": 1.0}
"""Whole episodes: the sheets lie on the way."""
USUAL = {"biped": Recipe(walking(5.0), (0, 1, 2)), "ugv": Recipe(DRIVING, (0, 1, 2))}
"""Of a task that has none of its own below."""
RECIPES = {
    "BipedSteady-v0": Recipe(walking(5.0), (0,)),
    "BipedFast-v0": Recipe(walking(6.5), (2,)),
    "BipedSlippery-v0": Recipe(walking(5.0), (2,)),
    "BipedWeakMotor-v0": Recipe(walking(5.0), (2,)),
    "BipedThrift-v0": Recipe(
        {"start_rate": 5.0, "episode_time": 1.5, "tracking_weight": 2.0, "fall_penalty": 1.0}, (0,)
    ),
    "BipedSprint-v1": Recipe({"start_rate": 5.0, "episode_time": 1.5}, (1,)),
    "BipedHiddenFriction-v0": Recipe(
        walking(6.0, timesteps=16_000_000, evaluation_episodes=256), (0,)
    ),
    "BipedPayload-v0": Recipe(walking(6.0), (2,)),
    "BipedIce-v0": Recipe(ON_ICE, (2,)),
    "BipedIceSeen-v0": Recipe(ON_ICE | {"final_noise": 0.03}, (4,)),
    "BipedStop-v0": Recipe({"start_rate": 3.0, "noise": 0.15, "discount": 0.998}, (0,)),
    "UGVBump-v1": Recipe(DRIVING, (0,)),
    "UGVRandomBumps-v1": Recipe(DRIVING, (0,)),
    "UGVRough-v1": Recipe(
        {
            "reward_scale": 0.005,
            "failure": 10.0,
            "noise": 0.3,
            "final_noise": 0.03,
            "discount": 0.9,
            "timesteps": 2_000_000,
            "num_envs": 256,
            "rollout_steps": 64,
            "batch_size": 2048,
        },
        (0,),
    ),
    "UGVDitch-v1": Recipe(
        {"failure": 10.0, "noise": 0.5, "final_noise": 0.05, "discount": 0.99}, (0,)
    ),
    "UGVLowGrip-v1": Recipe({"failure": 10.0}, (0,)),
    "UGVPatchyGrip-v1": Recipe({"failure": 10.0, "timesteps": 1_000_000}, (0, 1)),
}


def recipe_of(task: TaskDefinition) -> Recipe:
    """Of a task."""
    return RECIPES.get(task.name, USUAL[task.machine])


def configuration(task: TaskDefinition, seed: int) -> LearningConfiguration:
    """What the task's policy is trained with."""
    kind: Any = machine_by_name(task.machine).configuration
    return kind.of(task=task.name, seed=seed, **recipe_of(task).settings)
