"""Value iteration that was stopped goes on; another definition is not gone on with."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from stickslip.agents.optimum import solve
from stickslip.agents.optimum.blocks import KeptBlocks
from stickslip.agents.optimum.checkpoint import digest_of
from stickslip.agents.training.checkpoint import pack, unpack
from tests.agents.optimum.masses import ENV, PARAMS, MassStates

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
        (PARAMS, {"states": MassStates(low=-0.61)}),
        (PARAMS, {"fineness": 0.3}),
        (PARAMS, {"objective": "average"}),
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


def test_a_digest_tells_numbers_types_and_structures_apart():
    one = np.float32([1.0, 2.0])
    others = [np.float64(one), one[::-1], one[None], (one,), {"a": one}, [1.0, 2.0], "1.0, 2.0"]
    found = {digest_of(other) for other in [one, *others]}
    assert len(found) == 8
    assert digest_of(one.copy()) == digest_of(one)


class Stop(BaseException):
    """As a kill between two blocks."""


@pytest.fixture
def stopped(tmp_path, monkeypatch):
    """A run that was stopped when three blocks were there, and what it computes from then on."""
    module = import_module("stickslip.optim.dynamic_programming.outcomes")
    monkeypatch.setattr(module, "AT_ONCE", 40)
    write, calls = KeptBlocks.write, []

    def counted(self, number, block):
        calls.append(number)
        if number == 3:
            raise Stop
        write(self, number, block)

    path = tmp_path / "values.npz"
    monkeypatch.setattr(KeptBlocks, "write", counted)
    with pytest.raises(Stop):
        solve(ENV, PARAMS, steps=5, checkpoint=path, **GIVEN)
    assert calls == [0, 1, 2, 3]
    calls.clear()
    monkeypatch.setattr(KeptBlocks, "write", lambda *given: (calls.append(given[1]), write(*given)))
    return path, calls


def test_transitions_that_are_there_are_not_computed_again(stopped, monkeypatch):
    path, calls = stopped
    folder = path.with_name("values.npz.transitions")
    assert len(list(folder.iterdir())) == 3
    found = solve(ENV, PARAMS, steps=5, checkpoint=path, **GIVEN)
    assert calls[0] == 3
    assert calls == list(range(3, 3 + len(calls)))
    whole = solve(ENV, PARAMS, steps=5, **GIVEN)
    np.testing.assert_array_equal(found.values.value, whole.values.value)
    assert found.counts == whole.counts
    assert not folder.exists()


@pytest.mark.parametrize("damage", ["cut", "another", "astray", "user"])
def test_blocks_that_are_not_its_own_are_refused_or_left(stopped, damage):
    path, _ = stopped
    block = path.with_name("values.npz.transitions") / "000000001.npz"
    whole = block.read_bytes()
    if damage == "user":
        note = block.with_name("note.txt")
        note.write_text("mine", encoding="utf-8")
        solve(ENV, PARAMS, steps=5, checkpoint=path, **GIVEN)
        assert [one.name for one in block.parent.iterdir()] == ["note.txt"]
        return
    if damage == "cut":
        block.write_bytes(whole[:-40])
    elif damage == "another":
        block.write_bytes(block.with_name("000000002.npz").read_bytes())
    else:
        content = unpack(whole, 10**7)
        content["base"][0, 0] = 10**6
        block.write_bytes(pack(content))
    said = {"another": "of another task", "astray": "it leads nowhere", "cut": "cut short"}[damage]
    with pytest.raises(ValueError, match=rf"000000001\.npz: .*{said}.*accepted: what an earlier"):
        solve(ENV, PARAMS, steps=5, checkpoint=path, **GIVEN)
