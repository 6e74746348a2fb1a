"""Pages about the tasks say what the package knows of them."""

import pytest

from benchmarks.report import put_between, read_json
from benchmarks.tasks import finer
from benchmarks.tasks.__main__ import MARKS
from benchmarks.tasks.tables import long_table
from stickslip.agents.shipped.names import policy_name
from stickslip.agents.shipped.record import record_of
from stickslip.envs import TASKS, known_of
from tests.documents import ROOT


def test_the_page_s_table_is_of_what_is_known_and_shipped_now(tmp_path):
    there = (ROOT / "docs/tasks.md").read_text(encoding="utf-8")
    again = tmp_path / "page.md"
    again.write_text(there, encoding="utf-8")
    put_between(again, long_table(), MARKS)
    assert again.read_text(encoding="utf-8") == there


MEASURED = [name for name in finer.names() if name in read_json(finer.OUT)]


@pytest.mark.parametrize("name", MEASURED)
def test_no_best_known_and_no_policy_of_the_package_owes_its_score_to_the_setting(name):
    """As `python -m benchmarks.tasks.finer` measured those that are recorded now."""
    known, record = known_of(TASKS[name]), record_of(policy_name(name))
    assert known is not None
    rows = {one["policy"]: one for one in read_json(finer.OUT)[name]}
    recorded = {known.best.policy: known.best.value, record.short_name: record.earned_return}
    for policy, earned in recorded.items():
        assert rows[policy]["return"] == pytest.approx(earned, rel=1e-4, abs=1e-4)
        assert rows[policy]["owes"][0] <= finer.LIMIT
