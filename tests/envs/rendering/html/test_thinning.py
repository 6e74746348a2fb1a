"""A page has a size that it does not pass, whatever an episode is, and says what it leaves out."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.envs.rendering.html.data import Event, Line, Mark, Page, Panel, Shown
from stickslip.envs.rendering.html.document import page_text
from stickslip.envs.rendering.html.thinning import (
    EPISODE_BYTES,
    EPISODES_BYTES,
    MOST_LISTED,
    bounded,
    text_bytes,
    thinned,
)
from tests.envs.rendering.html.pages import finer, walked


def test_ten_seconds_of_any_step_stay_below_two_megabytes_and_say_so():
    fine = finer(walked(), 20)
    assert text_bytes(fine) > 2 * EPISODE_BYTES
    page = page_text(Page("fine", episodes=(fine,)))
    assert 1_500_000 < len(page.encode()) < 2_000_000
    (shown,) = bounded(Page("fine", episodes=(fine,))).episodes
    words = dict(shown.facts)["shown at"]
    assert words.startswith(f"{shown.samples:,} of {fine.samples:,} samples")
    assert words in page
    many = bounded(Page("many", episodes=(fine,) * 8)).episodes
    assert 0.9 * EPISODES_BYTES < sum(map(text_bytes, many)) < EPISODES_BYTES


def test_what_is_short_is_as_it_was():
    shown = walked()
    assert thinned(shown, EPISODE_BYTES) is shown


def test_ends_times_slips_and_slides_are_kept():
    fine = finer(walked(), 4)
    shown = thinned(fine, text_bytes(fine) // 3)
    assert shown.samples == pytest.approx(fine.samples / 3, rel=0.02)
    end = (fine.samples - 1) * fine.period
    assert (shown.samples - 1) * shown.period == pytest.approx(end)
    before, after = (one.panels[0].lines[0].values for one in (fine, shown))
    assert (after[0], after[-1]) == (before[0], before[-1])
    assert [one.time for one in shown.events] == [2.0, 2.9876]  # the instants are exact
    for one in shown.events:
        assert one.time is not None
        assert one.sample * shown.period == pytest.approx(one.time, abs=2 * shown.period)
    assert fine.slips is not None
    assert shown.slips is not None
    assert np.mean(shown.slips) == pytest.approx(np.mean(fine.slips), abs=0.01)
    for extreme in (np.nanmin, np.nanmax):
        smears = [one.drawing.smears for one in (fine, shown) if one.drawing is not None]
        assert extreme(smears[0]) == extreme(smears[1])


def test_a_slip_between_two_samples_is_not_lost():
    values, slips = np.arange(1001.0), np.zeros(1001, bool)
    slips[505] = True
    line = Panel("torque", "N m", (Line("torque", values),))
    shown = thinned(Shown("brief", 0.001, (line,), slips=slips), 400)
    assert shown.samples < 100
    assert shown.slips is not None
    assert np.sum(shown.slips) == 1
    assert shown.period * np.flatnonzero(shown.slips)[0] == pytest.approx(0.505, abs=shown.period)


def test_lists_are_bounded_too():
    shown = walked()
    assert shown.drawing is not None
    events = tuple(Event(i % 500, "slip", "slips", i / 1000) for i in range(MOST_LISTED + 99))
    marks = tuple(Mark(i % 500, i % 500, 0.0, 1 + i) for i in range(MOST_LISTED + 99))
    drawing = replace(shown.drawing, marks=marks)
    shown = thinned(replace(shown, events=events, drawing=drawing), EPISODE_BYTES)
    assert len(shown.events) == MOST_LISTED
    assert shown.events[-1] == events[-1]
    assert ("events listed", f"{MOST_LISTED:,} of {MOST_LISTED + 99:,}") in shown.facts
    assert shown.drawing is not None
    assert min(one.high for one in shown.drawing.marks) == 100  # the longest are kept


def test_pictures_beyond_the_room_are_named():
    picture = b"\x89PNG" + bytes(1_800_000)
    page = bounded(Page("p", pictures=(("small", b"\x89PNG"), ("one", picture), ("two", picture))))
    assert [title for title, _ in page.pictures] == ["small", "one"]
    assert page.notes == ("Pictures that this page has no room for: two.",)
