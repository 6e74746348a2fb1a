"""Whatever a configuration is asked to be, it is that, written and read, or refused by name."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.ugv.machine import UGVTrainConfig

KINDS = (TrainConfig, UGVTrainConfig)
each_kind = pytest.mark.parametrize("kind", KINDS)


def accepted_by(rule: Any, default: Any) -> st.SearchStrategy[Any]:
    """Values inside a field's own rule."""
    low, high = max(rule.low, -1e6), min(rule.high, 1e6)
    number = st.floats(math.nextafter(low, high) if rule.strict else low, high)
    if rule.choices:
        values = st.sampled_from(rule.choices)
    elif rule.kind is bool:
        values = st.booleans()
    elif rule.kind is str:
        values = st.just(default)
    elif rule.kind is int:
        values = st.integers(int(low), int(high))
    elif rule.kind == "range":
        values = st.tuples(number, number).map(lambda ends: tuple(sorted(ends)))
    else:
        values = number
    return st.none() | values if rule.optional else values


@st.composite
def some_fields(draw: st.DrawFn, kind: Any) -> dict[str, Any]:
    known = {one.name: one for one in fields(kind)}
    chosen = draw(st.lists(st.sampled_from(list(known)), max_size=4, unique=True))
    fields_of = {name: known[name] for name in chosen}
    return {n: draw(accepted_by(of.metadata["rule"], of.default)) for n, of in fields_of.items()}


def attempt(build: Callable[[], Any]) -> tuple[Any, str]:
    """The result, or None and the refusal."""
    try:
        return build(), ""
    except ValueError as error:
        return None, str(error)


@each_kind
@given(data=st.data())
def test_fields_are_kept_or_refused_by_name(kind: Any, data: st.DataObject):
    """Each field is inside its own rule: only what does not go together is refused."""
    drawn = data.draw(some_fields(kind))
    config, said = attempt(lambda: kind.of(**drawn))
    if config is not None:
        again = type(config).from_json(config.to_json())
        assert (again, again.digest) == (config, config.digest)
        assert again.to_json() == config.to_json()
    else:
        assert "accepted" in said
        assert any(name in said for name in drawn)
