"""The same runs come back from races' directories, and what cannot be is named."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.agents.optimisers import read_results
from stickslip.agents.optimisers.report import STORED, gaps, stored_results
from stickslip.optim import suite
from tests.agents.optimisers.table import NAME, kept, run

pytest.importorskip("pyarrow")


def test_runs_come_back_as_they_were(tmp_path):
    point = np.random.default_rng(0).normal(size=suite()[NAME].n)
    first = replace(run([(3, 1.0), (9, 0.1)], 100), point=point)
    runs = [first, run([], 7, seed=1, outcome="raised")]
    for before, after in zip(runs, read_results(kept(runs, tmp_path / "race")), strict=True):
        for name, value in vars(before).items():
            np.testing.assert_array_equal(getattr(after, name), value)  # to the last bit


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"instance": "gait-time-d17-v2"}, "id = 'gait-time-d17-v2' is unknown .did you mean"),
        ({"digest": "0123"}, f"digest 0123 is not that of {NAME} here"),
    ],
)
def test_a_run_of_another_instance_is_named_with_its_file(tmp_path, change, words):
    path = kept([replace(run([(3, 1.0)], 9), **change)], tmp_path / "race")
    with pytest.raises(ValueError, match=rf"cell-000000\.parquet: {words}"):
        read_results(path)


def test_the_package_has_runs_of_its_own_on_the_same_instances():
    assert STORED.stat().st_size < 2e6
    stored = stored_results([run([(3, 1.0)], 9, name=f"{NAME}-s1", method="cma")])
    methods = {one.method for one in stored}
    assert {one.instance for one in stored} == {f"{NAME}-s1"}
    assert methods & {"cma", "conic", "slsqp"} == {"conic", "slsqp"}  # cma's place is taken
    assert min(gaps(one)[-1] for one in stored) == pytest.approx(0.0, abs=1e-9)


def test_each_run_is_read_once(tmp_path):
    one, other = (kept([run([(3, 1.0)], 9)], tmp_path / name) for name in "ab")
    with pytest.raises(ValueError, match=r"mine on .* with seed 0 is also in .*accepted: each run"):
        read_results(one, other)
    with pytest.raises(ValueError, match="no directory; accepted: one at least"):
        read_results()
