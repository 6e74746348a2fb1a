"""Pages about the tasks say what the package knows of them."""

import pytest

from benchmarks.report import put_between
from benchmarks.tasks.__main__ import MARKS
from benchmarks.tasks.tables import long_table, short_table
from tests.documents import ROOT


@pytest.mark.parametrize(
    ("page", "table"), [("README.md", short_table), ("docs/tasks.md", long_table)]
)
def test_a_page_s_table_is_of_what_is_known_and_shipped_now(page, table, tmp_path):
    there = (ROOT / page).read_text(encoding="utf-8")
    again = tmp_path / "page.md"
    again.write_text(there, encoding="utf-8")
    put_between(again, table(), MARKS)
    assert again.read_text(encoding="utf-8") == there
