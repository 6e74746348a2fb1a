"""docs/paper.md and the recorded table of claims say what the command says."""

import re
from pathlib import Path

import pytest

from stickslip.cli import OK, main
from stickslip.paper.figure import FIGURES

pytest.importorskip("matplotlib")

DOCUMENT = Path(__file__).parents[2] / "docs" / "paper.md"
TEXT = DOCUMENT.read_text(encoding="utf-8")
TABLE = Path(__file__).with_name("table.md").read_text(encoding="utf-8").splitlines()[2:]
SLOW = {"fig25"}
"""Half a minute."""


def test_the_table_has_every_figure():
    rows = [line.strip("| ").split(" | ") for line in TABLE]
    assert {len(row) for row in rows} == {4}
    judged = [name for name in FIGURES if name not in ("fig16", "fig18")]  # curves only
    assert list(dict.fromkeys(row[0] for row in rows)) == judged


def test_every_figure_is_shown_by_its_picture():
    assert sorted(re.findall(r"\]\(paper/(\w+)\.png\)", TEXT)) == sorted(FIGURES)
    assert {path.stem for path in (DOCUMENT.parent / "paper").iterdir()} == set(FIGURES)


@pytest.mark.long
def test_the_table_is_the_commands(tmp_path: Path):
    names = [name for name in FIGURES if name not in SLOW]
    assert main(["reproduce", *names, "--out", str(tmp_path)]) == OK
    tables = [tmp_path / f"{name}.md" for name in names if (tmp_path / f"{name}.md").exists()]
    written = [line for one in tables for line in one.read_text("utf-8").splitlines()[2:]]
    assert written == [line for line in TABLE if line.split(" | ")[0].strip("| ") in names]
