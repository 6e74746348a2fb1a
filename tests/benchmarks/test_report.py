"""What benchmarks write leaves alone what they did not measure."""

from typing import NamedTuple

import pytest

from benchmarks import report

BEGIN, END = report.MARKS


def test_only_what_stands_between_the_marks_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter é\n", encoding="utf-8")
    for _ in range(2):
        report.put_between(page, "new")
        assert page.read_text(encoding="utf-8") == f"before\n{BEGIN}\nnew\n{END}\nafter é\n"
    assert [path.name for path in tmp_path.iterdir()] == ["page.md"]


@pytest.mark.parametrize("text", ["nothing here", BEGIN, f"{END} {BEGIN}", f"{BEGIN} {END} {END}"])
def test_a_page_without_a_place_for_the_tables_is_refused(tmp_path, text):
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="no place for the tables; accepted: one <!-- measured"):
        report.put_between(page, "new")
    assert page.read_text(encoding="utf-8") == text


def test_parts_of_earlier_runs_are_kept_with_their_commits(tmp_path):
    path = tmp_path / "deep" / "results.json"
    assert report.read_json(path) == {}
    one = {"commit": "one", "measured": "2020-01-02T03:04"}
    report.write_json({"commit": "old", "one": [1], "gone": [3], "parts": {"one": one}}, path)
    rows = [{"value": 1.5}, {"value": "b"}]
    content = report.measured_parts({"two": lambda quick: iter(rows)}, ["one", "two"], True, path)
    assert report.read_json(path) == content
    assert (content["one"], content["two"]) == ([1], rows)
    assert content["parts"]["one"] == one
    assert content["parts"]["two"]["quick"]
    assert content["commit"] != "old"
    assert "gone" not in content
    content["versions"]["jax"] = "1"
    assert report.where(content, "one").endswith("jax 1, commit one, 2020-01-02")
    assert report.where(content).endswith(f"commit {content['commit']}, {content['measured'][:10]}")


class Point(NamedTuple):
    """A setting's cost and two errors."""

    cost: float
    torque: float
    contact: float

    @property
    def error(self) -> float:
        """The worse of both."""
        return max(self.torque, self.contact)


def test_fronts_are_among_the_points():
    cheap, fine, slow = Point(1, 1e-2, 0.0), Point(2, 1e-4, 1e-5), Point(3, 1e-4, 0.0)
    assert report.front_of([Point(4, 1e-3, 1e-3), slow, fine, cheap]) == [cheap, fine]
    assert report.knee_of([slow, fine, cheap]) is fine
