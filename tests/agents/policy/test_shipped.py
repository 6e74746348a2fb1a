"""The policies of the package: one for each task, of the present definition, with its record."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from stickslip.agents import load_policy, read_metadata, save_policy, shipped_names
from stickslip.agents.evaluation.evaluate import evaluate_task
from stickslip.agents.machine import machine_by_name, read_configuration
from stickslip.agents.policy.file import every_record, policy_path, record_of
from stickslip.agents.policy.shipped import FOLDER, policy_name, shipped_path
from stickslip.agents.training.configuration import settings_given
from stickslip.cli import make_parser
from stickslip.envs import TASKS, known_of
from tests.asked import prints, refusal, tells

LARGEST, WITH_HISTORY = 40_000, 600_000
"""Bytes of a file, and of one whose policy has hundreds of inputs: it sees twelve steps."""
NEAR = 0.05
"""Of a score: single precision differs from machine to machine."""


def test_the_latest_version_is_meant_unless_one_is_named(tmp_path: Path):
    for name in ("biped-ice-v2", "biped-ice-v10", "biped-ice-melting-v0", "ugv-hover-v0"):
        (tmp_path / f"{name}.npz").write_bytes(b"")
    assert shipped_names(tmp_path) == ("biped-ice", "biped-ice-melting", "ugv-hover")
    found = {one: shipped_path(one, tmp_path) for one in ("biped-ice", "biped-ice-v2")}
    assert [path and path.stem for path in found.values()] == ["biped-ice-v10", "biped-ice-v2"]
    assert shipped_path("BipedIce-v2", tmp_path) == tmp_path / "biped-ice-v2.npz"
    for other in ("biped-ice-v3", "biped", "./biped-ice", "../biped-ice", "biped-ice.npz", ""):
        assert shipped_path(other, tmp_path) is None


def test_a_path_is_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    name = shipped_names()[0]
    (tmp_path / name).mkdir()
    assert policy_path(name).parent == FOLDER
    assert policy_path(f"./{name}") == Path(name) / "policy.npz"
    assert policy_path(Path(name)) == Path(name) / "policy.npz"


def test_every_task_has_a_policy():
    assert all(shipped_path(policy_name(name)) is not None for name in TASKS)
    assert len(shipped_names()) == len(TASKS)


def test_each_is_small_knows_its_task_and_is_of_its_present_definition():
    for one in every_record():
        assert policy_name(one.task.name).startswith(one.name)
        assert one.path.stat().st_size < (WITH_HISTORY if one.layer_sizes[0] > 64 else LARGEST)
        assert load_policy(one.name).layer_sizes == load_policy(one.path).layer_sizes
        known = known_of(one.task)
        assert known is not None
        assert one.earned["episodes"] == known.episodes
        assert 0 < one.trained["best_after"] <= one.trained["timesteps"]


def test_the_command_asks_for_the_configuration_that_the_policy_was_trained_with():
    for one in filter(lambda one: "config" in one.trained, every_record()):
        words = shlex.split(one.command)[1:]
        given = vars(make_parser(words).parse_args(words))
        kind = machine_by_name(words[1]).configuration
        config = kind.of(**settings_given(given, kind))
        assert config.task == one.task.name
        assert config == read_configuration(json.dumps(one.trained["config"]))


def test_evaluating_one_by_name_alone_scores_it_on_its_task(capsys):
    """The sprint is one episode, the cheapest to play."""
    said = prints(capsys, "evaluate", "biped-sprint")
    record = record_of("biped-sprint")
    (row,) = (line.split() for line in said.splitlines() if " biped-sprint " in line)
    assert row[0] == "BipedSprint-v1"
    assert float(row[4].replace("−", "-")) == pytest.approx(record.score.value, abs=NEAR)


def test_what_is_best_known_by_a_policy_of_the_package_is_what_its_file_says():
    best = {name: known_of(task).best for name, task in TASKS.items()}
    shipped = {name: one for name, one in best.items() if one.policy in shipped_names()}
    assert "BipedSprint-v1" in shipped
    for name, one in shipped.items():
        record = record_of(one.policy)
        assert record.task.name == name
        assert one.value == record.earned["return"]
        assert one.failures == record.earned["failures"]
        assert record.command in known_of(TASKS[name]).how


@pytest.mark.long
@pytest.mark.parametrize("name", shipped_names())
def test_each_earns_what_its_file_says(name: str):
    record = record_of(name)
    table = evaluate_task(record.task.name, {name: load_policy(name)})
    score = table.row(record.task.name, name).metrics["task_score"].value
    assert score == pytest.approx(record.score.value, abs=NEAR)


def changed(tmp_path: Path, **entries: object) -> str:
    """The path of a policy of the package with other entries in its metadata."""
    own = ("format", "version", "layer_sizes", "activation", "squash", "observation_clip")
    known = {k: v for k, v in read_metadata("biped-ice").items() if k not in (*own, "versions")}
    return str(save_policy(load_policy("biped-ice"), tmp_path / "mine.npz", known | entries))


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (
            {"name": "BipedIce-v0", "digest": "0123456789abcdef"},
            (
                "'BipedIce-v0', saved by stickslip 0.",
                "'0123456789ab'",
                "stickslip train biped --task",
            ),
        ),
        ({"name": "BipedIce-v0"}, ("no name with a digest",)),
    ],
)
def test_a_policy_of_another_definition_is_refused_everywhere(tmp_path, capsys, entry, said):
    path = changed(tmp_path, named_task=entry)
    with pytest.raises(ValueError, match=r"mine\.npz: ") as caught:
        load_policy(path)
    for part in said:
        assert part in str(caught.value)
    assert said[0] in refusal(capsys, "evaluate", path)


def test_list_words_and_json_tell_of_every_policy_and_of_a_file(capsys, tmp_path: Path):
    lines = prints(capsys, "policies").splitlines()
    for one in every_record():
        (line,) = (line for line in lines if line.startswith(f"{one.name} "))
        assert one.task.title in line
        assert one.score.shown(2) in line
    said = prints(capsys, "policies", "biped-ice")
    for part in (record_of("biped-ice").command, "digest", "jaxlib", "best_after"):
        assert part in said
    said = prints(capsys, "policies", changed(tmp_path, mood="\x1bgood"))
    for part in (f"path = {tmp_path / 'mine.npz'}", "layer_sizes = [", "best_after", "mood = good"):
        assert part in said
    (one,) = tells(capsys, "policies", "ugv-bump")["policies"]
    assert (one["task"], one["digest"]) == ("UGVBump-v1", TASKS["UGVBump-v1"].digest)
