"""--json: one object on standard output and nothing else, whatever is printed for people."""

import json
import math

import numpy as np
import pytest

from stickslip.agents import shipped_names
from stickslip.cli import COMMANDS, OK, WRONG_INPUT, main
from stickslip.envs import TASKS
from stickslip.records.table import Column, Content, Table
from tests.asked import prints


def strict(text: str) -> dict:
    """JSON by the letter: NaN and infinities are refused."""

    def refuse(name: str) -> float:
        raise ValueError(name)

    return json.loads(text, parse_constant=refuse)


def test_what_is_not_finite_is_null_and_every_column_has_a_unit():
    table = Table(
        [Column("name", words=True), Column("slid", "m")],
        [["a", 0.1 + 0.2], ["b", math.nan], ["c", np.float32(np.inf)], ["d", None]],
    )
    facts = {"values": np.array([1.0, -np.inf]), "nested": [{"x": math.nan}]}
    told = strict(Content({"rows": table}, facts, {"values": "N"}, 1).json("try"))
    assert list(told) == ["command", "exit_status", "units", "rows", "values", "nested"]
    assert told["rows"][0] == {"name": "a", "slid": 0.1 + 0.2}
    assert [row["slid"] for row in told["rows"][1:]] == [None, None, None]
    assert told["units"] == {"rows": {"name": "-", "slid": "m"}, "values": "N"}
    assert (told["values"], told["nested"]) == ([1.0, None], [{"x": None}])


@pytest.mark.parametrize(
    ("command", "key", "names"),
    [(["tasks"], "tasks", list(TASKS)), (["policies"], "policies", list(shipped_names()))],
)
def test_lists_are_one_object(capsys, command: list[str], key: str, names: list[str] | None):
    told = strict(prints(capsys, *command, "--json"))
    assert (told["command"], told["exit_status"]) == (command[0], OK)
    assert set(told["units"]) == {key}
    assert names is None or [row["name"] for row in told[key]] == names
    assert main(command) == OK
    with pytest.raises(json.JSONDecodeError):
        json.loads(capsys.readouterr().out)


def test_commands_with_a_table_have_the_flag_and_only_they(capsys):
    without = {"train", "view", "export"}
    for name in COMMANDS:
        assert COMMANDS[name].json is not (name in without)
    assert main(["export", "biped-ice", "--out", "x.npz", "--json"]) == WRONG_INPUT
    assert "unrecognized arguments: --json" in capsys.readouterr().err
