"""Value iteration that was stopped goes on; another definition is not gone on with."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.agents.optimum import solve
from tests.agents.optimum.processes import ENV, PARAMS, MassStates

GIVEN = {"states": MassStates(), "actions": 5, "fineness": 0.25}


def test_a_run_that_was_stopped_ends_with_the_same_bits(tmp_path):
    path = tmp_path / "values.npz"
    part = solve(ENV, PARAMS, steps=13, checkpoint=path, **GIVEN)
    assert part.values.sweeps == 13
    again = solve(ENV, PARAMS, steps=30, checkpoint=path, **GIVEN)
    whole = solve(ENV, PARAMS, steps=30, **GIVEN)
    assert again.values.sweeps == 30
    np.testing.assert_array_equal(again.values.value, whole.values.value)
    assert [one.name for one in tmp_path.iterdir()] == ["values.npz"]
    with pytest.raises(ValueError, match=r"holds 30 sweeps; accepted: at most steps = 13"):
        solve(ENV, PARAMS, steps=13, checkpoint=path, **GIVEN)


@pytest.mark.parametrize(
    ("params", "given"),
    [
        (replace(PARAMS, mu=0.31), {}),
        (PARAMS, {"actions": 6}),
        (PARAMS, {"fineness": 0.3}),
    ],
)
def test_another_definition_is_refused_and_the_file_left(tmp_path, params, given):
    path = tmp_path / "values.npz"
    solve(ENV, PARAMS, steps=2, checkpoint=path, **GIVEN)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"values\.npz: it is of another task, grid or set"):
        solve(ENV, params, steps=2, checkpoint=path, **(GIVEN | given))
    assert path.read_bytes() == before


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "values.npz"
    solve(ENV, PARAMS, steps=2, checkpoint=path, **GIVEN)
    whole = path.read_bytes()
    for raw in (whole[:-30], b"", b"no archive", whole[:100] + bytes(40) + whole[140:]):
        path.write_bytes(raw)
        with pytest.raises(ValueError, match=r"values\.npz: .*accepted: what an earlier run"):
            solve(ENV, PARAMS, steps=2, checkpoint=path, **GIVEN)
        assert path.read_bytes() == raw
