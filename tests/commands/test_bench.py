"""`stickslip bench optimisers`."""

import json

from stickslip.cli import OK, main


def test_methods_and_errors_are_those_of_a_command(capsys):
    assert main(["bench", "optimisers", "methods", "--json"]) == OK
    told = json.loads(capsys.readouterr().out)
    assert "`slsqp`" in [row["method"] for row in told["methods"]]
    assert main(["bench", "--json", "optimisers", "report", "nowhere.csv", "--out", "x"]) == 2
    assert capsys.readouterr().out == ""
