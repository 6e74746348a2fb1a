"""Whatever a configuration is asked to be, it is that, written and read, or refused by name."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.training.configuration import every_field, rule_of
from stickslip.agents.ugv.config import UGVTrainConfig

KINDS = (TrainConfig, UGVTrainConfig)
each_kind = pytest.mark.parametrize("kind", KINDS)

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=5,
)


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
    fields = st.sampled_from(every_field(kind))
    chosen = draw(st.lists(fields, max_size=4, unique_by=lambda one: one.name))
    return {one.name: draw(accepted_by(rule_of(one), one.default)) for one in chosen}


def attempt(build: Callable[[], Any]) -> tuple[Any, str]:
    """The result, or None and the refusal."""
    try:
        return build(), ""
    except ValueError as error:
        return None, str(error)


def assert_kept(config: Any) -> None:
    again = type(config).from_json(config.to_json())
    assert again == config
    assert again.digest == config.digest
    assert again.to_json() == config.to_json()


@each_kind
@given(data=st.data())
def test_fields_are_kept_or_refused_by_name(kind: Any, data: st.DataObject):
    """Each field is inside its own rule: only what does not go together is refused."""
    fields = data.draw(some_fields(kind))
    config, said = attempt(lambda: kind.of(**fields))
    if config is not None:
        assert_kept(config)
    else:
        assert "accepted" in said
        assert any(name in said for name in fields)


@each_kind
@settings(max_examples=100)
@given(data=st.data())
def test_a_damaged_file_is_a_configuration_or_refused(kind: Any, data: st.DataObject):
    content = json.loads(kind.of().to_json())
    at = content
    while isinstance(at, dict) and at:
        within, key = at, data.draw(st.sampled_from(sorted(at)))
        at = at[key]
    within[key] = data.draw(JSON)
    text = json.dumps(content)
    text = text[: data.draw(st.none() | st.integers(0, len(text)))]
    config, said = attempt(lambda: kind.from_json(text))
    if config is not None:
        assert_kept(config)
    else:
        assert 0 < len(said) < 1500
