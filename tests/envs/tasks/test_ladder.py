"""A task never changes under its name, and says all that its environment needs."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import gymnasium
import jax
import numpy as np
import pytest

import stickslip  # noqa: F401, registers
from stickslip.agents.policy.file import named_task_of
from stickslip.agents.untrusted import RefusedError
from stickslip.envs import TASKS, TaskDefinition, task_by_name
from stickslip.envs.biped.params import NUMBERS
from stickslip.envs.functional import horizon
from stickslip.envs.tasks.definition import WITHDRAWN
from stickslip.envs.tasks.known import known_of

DIGESTS: dict[str, list[str]] = json.loads(
    (Path(__file__).parent / "digests.json").read_text(encoding="utf-8")
)
"""Of every definition that ever was, and of what it builds; a changed one gets a new version."""


def built(task: TaskDefinition) -> str:
    """A digest of the environment's choices and of every number that its parameters were given,
    the reference robot's and vehicle's too, to four digits: what is fitted to them is left out."""
    env, params = task.make()
    if task.machine == "biped":
        names = ("scene", "randomisation", *NUMBERS)
        given = [params.robot.bare, *(getattr(params, name) for name in names)]
    else:
        names = ("vehicle", "randomisation", "friction", "leg_rate", "spacing", "start", "end")
        names += ("start_angles", "min_clearance", "preview_length", "preview_noise")
        given = [params.track.shape, *(getattr(params, name) for name in names)]
        given += [params.reward_scale, params.failure_penalty]
    leaves, structure = jax.tree.flatten(given)
    numbers = [f"{value:.4g}" for leaf in leaves for value in np.ravel(np.asarray(leaf))]
    kinds = [type(one).__name__ for one in given]
    text = json.dumps([str(env), kinds, structure.num_leaves, numbers])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def test_no_definition_has_changed_under_its_name():
    assert {name: task.digest for name, task in TASKS.items()} == {
        name: both[0] for name, both in DIGESTS.items() if name not in WITHDRAWN
    }
    assert not set(TASKS) & set(WITHDRAWN)


@pytest.mark.parametrize("name", TASKS)
def test_what_is_built_of_a_definition_has_not_changed_either(name):
    task = TASKS[name]
    assert built(task) == DIGESTS[name][1]
    assert horizon(task.make()[1]) == task.max_episode_steps
    assert gymnasium.spec(task.id).max_episode_steps == task.max_episode_steps


def test_a_digest_tells_of_every_number_that_decides_an_episode():
    task = TASKS["BipedSprint-v1"]
    floor = {"uniform": {"mu_static": 0.06, "mu_kinetic": 0.0500001}}
    others = [
        replace(task, parameters={**task.parameters, "scene": floor}),
        replace(task, choices={"see_friction": True}),
        replace(task, version=task.version + 1),
        replace(task, environment="UGVEnv"),
    ]
    assert len({task.digest, *(one.digest for one in others)}) == 5
    assert replace(task, title="another", about="words").digest == task.digest


def test_there_are_a_dozen_tasks_of_both_machines_with_ids_of_their_names():
    assert len(TASKS) >= 12
    assert {task.machine for task in TASKS.values()} == {"biped", "ugv"}
    for name, task in TASKS.items():
        assert name == f"{task.stem}-v{task.version}"
        assert task_by_name(task.id) is task_by_name(name) is task
        assert gymnasium.spec(task.id).kwargs == {"task": name}
        plain = [task.parameters, task.choices]
        assert json.loads(json.dumps(plain)) == plain


def test_a_task_is_solved_from_a_score_of_0_9():
    task = TASKS["UGVLowGrip-v1"]
    known, spec = known_of(task), gymnasium.spec(task.id)
    assert known is not None
    assert spec.reward_threshold is not None
    assert known.scale.score(spec.reward_threshold) == pytest.approx(0.9, abs=1e-4)


def test_a_task_takes_no_options_and_says_where_they_go():
    with pytest.raises(ValueError, match=r"mean_rate.*fixed.*stickslip/Biped-v0"):
        gymnasium.make("stickslip/BipedSprint-v1", mean_rate=3.0)
    with pytest.raises(ValueError, match=r"track.*fixed.*stickslip/UGV-v0"):
        gymnasium.make_vec("stickslip/UGVBump-v1", num_envs=2, track="flat")


@pytest.mark.parametrize(
    ("name", "near"), [("BipedSprit-v0", r" \(did you mean BipedSprint-v1\?\)"), (3, "")]
)
def test_an_unknown_task_brings_the_known_ones_and_the_nearest(name, near):
    with pytest.raises(ValueError, match=rf"is unknown; accepted: 'BipedSteady-v0', .*'{near}$"):
        task_by_name(name)


def test_a_withdrawn_version_is_refused_with_the_reason_and_the_latest(monkeypatch):
    monkeypatch.setitem(WITHDRAWN, "BipedSteady-v99", "it walked through walls")
    for name in ("BipedSteady-v99", "stickslip/BipedSteady-v99"):
        with pytest.raises(ValueError, match=r"withdrawn: it walked .*; accepted: BipedSteady-v"):
            task_by_name(name)
    saved = {"named_task": {"name": "BipedSteady-v99", "digest": "0"}}
    with pytest.raises(RefusedError, match=r"saved by stickslip 1.0; .*withdrawn: it walked"):
        named_task_of(saved | {"versions": {"stickslip": "1.0"}})
