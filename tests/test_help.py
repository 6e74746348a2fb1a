"""What the command line's help says, and how scenes are told from policies."""

import inspect
import shlex
from dataclasses import fields

import pytest

from stickslip.agents.biped.machine import BipedMachine, TrainConfig
from stickslip.agents.ugv.machine import TRACK_NAMES, UGVMachine, UGVTrainConfig
from stickslip.cli import COMMANDS, OK, main, make_parser
from stickslip.commands import EXAMPLES, GROUPS
from stickslip.dynamics.names import SCENES
from stickslip.dynamics.ugv import TRACKS, Track
from stickslip.flags import TRACK_OPTIONS
from stickslip.optim import CRITERIA, METHODS
from stickslip.optim.posture import CRITERIA_IN_WORDS
from stickslip.paper.figure import FIGURES
from tests.asked import refusal


def help_of(capsys: pytest.CaptureFixture[str], *command: str) -> str:
    """What a command prints of itself, on one line."""
    with pytest.raises(SystemExit) as left:
        main([*command, "--help"])
    assert left.value.code == OK
    return " ".join(capsys.readouterr().out.split())


def test_help_names_every_field_of_the_configuration(capsys):
    shown = help_of(capsys, "train", "biped")
    for name in (one.name for one in fields(TrainConfig)):
        flag = f" --{name.replace('_', '-')} "
        assert (flag if name in TrainConfig.FLAGS else f" {name}=") in shown


def test_help_names_what_may_be_named(capsys):
    for command in ("evaluate", "view"):
        shown = help_of(capsys, command)
        for names in (BipedMachine.baselines, UGVMachine.baselines, SCENES, TRACK_NAMES, CRITERIA):
            assert all(name in shown for name in names)
    assert ", ".join(SCENES) in help_of(capsys, "train", "biped")
    shown = help_of(capsys, "train", "ugv")
    assert all(name in shown for name in (*TRACK_NAMES, *CRITERIA))
    shown = help_of(capsys, "optimise", "ugv")
    assert all(f" {name} {about}" in shown for name, about in METHODS.items())
    assert all(f" {name} {one.about}" in shown for name, one in CRITERIA.items())
    shown = help_of(capsys, "reproduce")
    assert all(f" {name} {figure.title}" in shown for name, figure in FIGURES.items())


def test_help_gives_criteria_and_tracks_as_the_library_has_them(capsys):
    assert tuple(TRACK_OPTIONS) == TRACKS
    assert {name: one.about for name, one in CRITERIA.items()} == CRITERIA_IN_WORDS
    shown = help_of(capsys, "optimise", "ugv")
    for name, words in TRACK_OPTIONS.items():
        parameters = inspect.signature(getattr(Track, name)).parameters.values()
        defaults = {p.name: p.default for p in parameters if p.default is not p.empty}
        if name != "rough":
            shape = type(Track.named(name).shape)
            defaults = {one.name: one.default for one in fields(shape)} | defaults
        assert list(words) == [f"{key}={value}" for key, value in defaults.items()]
        assert f" {name} {', '.join(words)}" in shown


@pytest.mark.parametrize("kind", [TrainConfig, UGVTrainConfig])
def test_settings_stand_below_the_flags_with_the_defaults_of_each_trainer(capsys, kind):
    shown = help_of(capsys, "train", kind.machine)
    _, settings = shown.split("settings, as --set NAME=VALUE: ")
    assert "--" not in settings.partition("examples:")[0]
    if kind is TrainConfig:
        assert (
            f"(default: {TrainConfig().timesteps}; sb3: {kind.of(trainer='sb3').timesteps})"
            in shown
        )


@pytest.mark.parametrize("name", COMMANDS)
def test_every_example_of_a_command_is_one_that_it_takes(capsys, name: str):
    examples = COMMANDS[name].examples
    shown = help_of(capsys, name)
    assert examples
    for line, about in examples.items():
        assert f"{about}: {line}" in shown
        words = shlex.split(line)
        words = words[1 : next((i for i, word in enumerate(words) if word[0] == ">"), None)]
        assert make_parser(words).parse_args(words).command == words[0]
    assert name in {line.split()[1] for line in examples}


def test_the_help_lists_examples_and_then_every_command_once_by_purpose(capsys):
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(COMMANDS)
    shown = help_of(capsys)
    places = [shown.index("examples:"), *(shown.index(f" {title}: ") for title in GROUPS)]
    assert places == sorted(places)
    for name, command in COMMANDS.items():
        assert f" {name} {command.about}" in shown
    for line in list(EXAMPLES)[:-1]:
        assert make_parser(words := shlex.split(line)[1:]).parse_args(words)


@pytest.mark.parametrize("command", ["simulate", "optimise", "train", "sweep"])
def test_a_line_without_a_machine_says_which_there_are(capsys, command: str):
    for rest in ("", "--out x", "bipde"):
        said = refusal(capsys, command, *rest.split())
        assert all(machine in said for machine in ("biped", "ugv"))
    shown = help_of(capsys, command).partition("options:")[2]
    assert "--out" not in shown
    assert all(f" {machine} " in shown for machine in ("biped", "ugv"))


def given(line: str) -> dict:
    words = shlex.split(line)
    return vars(make_parser(words).parse_args(words))


def test_flags_and_settings_are_read_by_their_types():
    line = "optimise ugv --track-option height=0.2 --track-option width=2 --no-pictures"
    asked = given(f"{line} --set start_angles=1,2 overlap=true --set end=-3 vehicle.leg_mass=1")
    assert asked["track_options"] == ["height=0.2", "width=2"]
    assert (asked["pictures"], asked["overlap"], asked["end"]) == (False, True, -3.0)
    assert (asked["start_angles"], asked["end_angles"], asked["leg_rate"]) == ([1.0, 2.0], None, 1)
    assert asked["changes"] == {"vehicle.leg_mass": "1"}
    asked = given("simulate biped --torque -crank_rate --mu-static 0.5 0.1 --edges -1e-3")
    assert asked["torque"] == "-crank_rate"
    assert (asked["mu_static"], asked["edges"]) == ([0.5, 0.1], [-0.001])
