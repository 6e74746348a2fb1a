"""Tables that others wrote: the same runs come back, and what cannot be is named."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.optimisers import read_results, write_results
from stickslip.agents.optimisers.runs import COLUMNS
from stickslip.optim import suite
from tests.agents.optimisers.table import BEST, NAME, run

pytest.importorskip("pyarrow")


@pytest.mark.parametrize("kind", ["parquet", "csv"])
def test_runs_come_back_as_they_were(tmp_path, kind):
    point = np.random.default_rng(0).normal(size=suite()[NAME].n)
    first = replace(run([(3, 1.0), (9, 0.1)], 100), point=point)
    runs = [first, run([], 7, seed=1, outcome="timed out")]
    path = write_results(runs, tmp_path / f"mine.{kind}")
    found = read_results(path)
    for before, after in zip(runs, found, strict=True):
        assert after.rows() == before.rows()
    np.testing.assert_array_equal(found[0].point, point)  # to the last bit
    assert found[1].point is None
    with pytest.raises(ValueError, match="exists; accepted: a new path"):
        write_results(runs, path)
    with pytest.raises(ValueError, match=r"ends in \.parquet or \.csv"):
        write_results(runs, tmp_path / "mine.txt")


def test_columns_have_a_meaning_and_the_page_names_them_all(tmp_path):
    from pyarrow import parquet

    schema = parquet.read_schema(write_results([run([(1, 1.0)], 2)], tmp_path / "a.parquet"))
    page = (Path(__file__).parents[3] / "docs/suite.md").read_text("utf-8")
    assert schema.names == list(COLUMNS)
    for name, (_, meaning) in COLUMNS.items():
        assert schema.field(name).metadata[b"meaning"].decode() == meaning
        assert f"`{name}`" in page


def few(tmp_path: Path, rows: list[dict[str, object]], name: str = "few.csv") -> Path:
    """A table of the columns that must be there, and others of the rows'."""
    usual = {"instance": NAME, "method": "theirs", "seed": 0, "evaluations": 5, "value": BEST + 1}
    rows = [usual | row for row in rows]
    path = tmp_path / name
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)))
        writer.writeheader()
        writer.writerows(rows)
    return path


def test_five_columns_are_enough(tmp_path):
    (found,) = read_results(few(tmp_path, [{}, {"evaluations": 9, "value": BEST}]))
    assert found.evaluations.tolist() == [5, 9]
    assert (found.best, found.outcome) == (pytest.approx(BEST), "ended")
    assert np.isnan(found.seconds).all()


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([{"instance": "gait-time-d17-v2"}], "row 1: instance .* is unknown .did you mean gait-ti"),
        ([{"evaluations": 9}, {"evaluations": 5, "value": BEST}], "fall from row to row"),
        ([{}, {"evaluations": 9, "value": BEST + 2}], "the best value rises"),
        ([{"value": BEST * 0.9}], "is below the proved bound"),
        ([{"evaluations": -1}], "row 1: evaluations = -1; accepted: an integer, >= 0"),
        ([{"seed": "first"}], "column seed does not hold int64"),
        ([{"value": "inf"}], "row 1: value = inf .*accepted: finite, or nothing"),
        ([{"digest": "0123"}], "digest 0123 is not that of the instance here"),
        ([{"walue": 1}], "column 'walue' is unknown .did you mean value"),
        ([{"point": "[1.0, 2.0]"}], "row 1: point = .*, a list of 16 numbers"),
    ],
)
def test_what_cannot_be_is_named_with_the_file(tmp_path, rows, words):
    with pytest.raises(ValueError, match=rf"few\.csv: .*{words}.*docs/suite\.md"):
        read_results(few(tmp_path, rows))


def test_damage_is_named(tmp_path):
    path = write_results([run([(3, 1.0)], 100)], tmp_path / "mine.parquet")
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(ValueError, match=r"mine\.parquet: it is damaged"):
        read_results(path)
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(ValueError, match=r"empty\.csv: it is damaged"):
        read_results(tmp_path / "empty.csv")
    lacking = few(tmp_path, [{}])
    lacking.write_text(lacking.read_text().replace("value", "walue"))
    with pytest.raises(ValueError, match="no column 'value'; its columns are instance, method"):
        read_results(lacking)
    with pytest.raises(ValueError, match=r"none\.csv: no such file"):
        read_results(tmp_path / "none.csv")
    with pytest.raises(ValueError, match=r"race\.json: no such file"):
        read_results(tmp_path)
    with pytest.raises(ValueError, match="no file; accepted: one at least"):
        read_results()
