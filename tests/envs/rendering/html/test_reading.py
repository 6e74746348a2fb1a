"""The episodes of a page are read back as they were, and damaged pages are refused by name."""

import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.envs.rendering.html.document import page_text
from stickslip.envs.rendering.html.encode import script_text
from stickslip.envs.rendering.html.reading import BEGINS, ENDS, read_episodes
from tests.envs.rendering.html.pages import page, walked


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    path = tmp_path / "page.html"
    path.write_text(page_text(page("one", "two")), encoding="utf-8")
    return path


def test_a_page_is_read_as_it_was_written(kept: Path):
    one, two = read_episodes(kept)
    assert (one.name, two.name) == ("one", "two")
    assert one.drawing is not None
    assert walked().drawing is not None
    np.testing.assert_array_equal(one.drawing.points, walked().drawing.points)
    assert one.drawing.parts[0].role == walked().drawing.parts[0].role
    assert one.events == walked().events


def test_what_is_read_is_written_the_same_again(kept: Path):
    again = read_episodes(kept)
    assert script_text(again) == script_text(read_episodes(kept))
    np.testing.assert_allclose(
        again[0].panels[0].lines[0].values, walked().panels[0].lines[0].values, atol=2e-5
    )


def test_a_page_from_before_events_had_times_is_read(kept: Path):
    text = kept.read_text(encoding="utf-8")
    for later in (r',"time":(null|[\d.]+)', r',"spans":\{.*?\}', r',"timing":".*?"'):
        text, count = re.subn(later, "", text)
        assert count >= 2
    kept.write_text(text, encoding="utf-8")
    one, _ = read_episodes(kept)
    assert [event.time for event in one.events] == [None, None]
    assert (one.spans, one.timing) == (None, "")
    np.testing.assert_array_equal(one.slips, walked().slips)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[:-400_000], "holds no episodes"),
        (lambda text: text.replace('"period":0.02', '"period":"x"'), "is damaged"),
        (lambda text: text.replace('"period":0.02', '"period":-1'), "is damaged"),
        (lambda text: text.replace('"parts":[{', '"parts":[3,{', 1), "is damaged"),
        (lambda text: text.replace('"data":"', '"data":"AAA', 1), "is damaged"),
        (lambda text: "<p>another page</p>", "holds no episodes"),
        (lambda text: BEGINS * 20_000, "holds no episodes"),  # at once: it was quadratic
        (lambda text: f'{BEGINS}{{"episodes": {"[" * 100_000}{ENDS}', "is damaged"),
    ],
)
def test_a_damaged_page_is_refused_by_name(kept: Path, change, said: str):
    text = kept.read_text(encoding="utf-8")
    kept.write_text(change(text), encoding="utf-8")
    with pytest.raises(ValueError, match=f"page.html {said}"):
        read_episodes(kept)
    with pytest.raises(ValueError, match="is no file"):
        read_episodes(kept.with_name("none.html"))
