"""The programs of docs/suite.md run as printed, one after the other."""

import re
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[1] / "docs" / "suite.md"
PROGRAMS = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.M)


def test_the_page_s_programs_run_and_find_something(capsys):
    assert len(PROGRAMS) == 5
    names: dict = {"__name__": "page"}
    for code in PROGRAMS:
        exec(compile(code, str(PAGE), "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    assert names["objective"].n == 8
    assert np.isfinite(names["record"].best)
    assert names["one"].id == "valley-d2-v1"
    assert printed[-1].endswith(" 1.0")


def test_ten_lines_are_ten():
    (program,) = (code for code in PROGRAMS if "def search" in code)
    assert len([line for line in program.splitlines() if line.strip()]) <= 10
