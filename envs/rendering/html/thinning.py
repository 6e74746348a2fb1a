"""Pages of bounded size: what would make one too large is thinned out, and the page says so."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from stickslip.envs.rendering.html.data import Contact, Drawing, Event, Mark, Page, Shown

EPISODE_BYTES = 1_800_000
"""Of an episode's arrays in a page, at most."""
EPISODES_BYTES = 6_000_000
"""Of all episodes of a page together."""
PICTURES_BYTES = 3_000_000
"""Of a page's pictures, as they stand in it."""
MOST_LISTED = 2000
"""Events of an episode, and slides with their lengths: of more, those that are listed."""
LEAST = 2


def bounded(page: Page) -> Page:
    """The page with as much of its episodes and pictures as it has room for, and what it lacks in
    words: beside each episode, and in a note for the pictures."""
    room = min(EPISODE_BYTES, EPISODES_BYTES // max(1, len(page.episodes)))
    episodes = tuple(thinned(one, room) for one in page.episodes)
    kept, left, spent = [], [], 0
    for title, content in page.pictures:
        spent += 4 * len(content) // 3
        (kept if spent <= PICTURES_BYTES else left).append((title, content))
    notes = page.notes
    if left:
        names = ", ".join(title for title, _ in left)
        notes = (*notes, f"Pictures that this page has no room for: {names}.")
    return replace(page, episodes=episodes, pictures=tuple(kept), notes=notes)


def thinned(shown: Shown, most: int) -> Shown:
    """An episode that takes at most so many bytes of a page [base64], if need be at fewer samples.

    First and last sample are kept, the others as evenly as they go, each by up to half a period
    off its time. What slipped, or was slid over, since the sample before is kept with each; peaks
    of curves between two are not.
    """
    shown = _shorter_lists(shown)
    size, count = text_bytes(shown), shown.samples
    if size <= most:
        return shown
    fixed = size - text_bytes(_at(shown, np.arange(LEAST)))
    each = fixed / (count - LEAST)
    keep = int(max(LEAST, min(count - 1, LEAST + (most - (size - fixed)) / each)))
    which = np.rint(np.linspace(0, count - 1, keep)).astype(int)
    words = f"{keep:,} of {count:,} samples; what lies between two may be missing"
    return replace(_at(shown, which), facts=(*shown.facts, ("shown at", words)))


def text_bytes(value: object) -> int:
    """What the arrays of a tree take as base64: 2 bytes a number, 4 in single precision."""
    if isinstance(value, np.ndarray):
        return 4 * value.size * (4 if value.dtype == np.float32 else 2) // 3
    if is_dataclass(value):
        return sum(text_bytes(getattr(value, one.name)) for one in fields(value))
    if isinstance(value, tuple | list):
        return sum(map(text_bytes, value))
    return 0


def _shorter_lists(shown: Shown) -> Shown:
    events, drawing, facts = shown.events, shown.drawing, shown.facts
    if len(events) > MOST_LISTED:
        kept = (*events[: MOST_LISTED - 1], events[-1])
        facts = (*facts, ("events listed", f"{MOST_LISTED:,} of {len(events):,}"))
        shown = replace(shown, events=kept, facts=facts)
    if drawing is not None and len(drawing.marks) > MOST_LISTED:
        longest = sorted(drawing.marks, key=lambda one: one.low - one.high)[:MOST_LISTED]
        marks = tuple(sorted(longest, key=lambda one: one.first))
        shown = replace(shown, drawing=replace(drawing, marks=marks))
    return shown


def _at(shown: Shown, which: np.ndarray) -> Shown:
    """An episode at some of its samples alone, in rising order, the first among them."""
    last = int(which[-1])
    period = shown.period * last / (len(which) - 1)

    def rows(values: np.ndarray) -> np.ndarray:
        return values[which]

    slips = None if shown.slips is None else _any_since(shown.slips, which)
    drawing = None if shown.drawing is None else _drawing_at(shown.drawing, which, rows)
    panels = tuple(
        replace(one, lines=tuple(replace(line, values=rows(line.values)) for line in one.lines))
        for one in shown.panels
    )
    return replace(
        shown,
        period=period,
        panels=panels,
        events=tuple(_event_at(one, shown.period, which) for one in shown.events),
        numbers=tuple((title, rows(values), digits) for title, values, digits in shown.numbers),
        slips=slips,
        drawing=drawing,
    )


def _drawing_at(
    drawing: Drawing, which: np.ndarray, rows: Callable[[np.ndarray], np.ndarray]
) -> Drawing:
    smears, seen, active = drawing.smears, drawing.seen, drawing.active
    return replace(
        drawing,
        points=rows(drawing.points),
        bodies=rows(drawing.bodies),
        contacts=tuple(_contact_at(one, which, rows) for one in drawing.contacts),
        focus=rows(drawing.focus),
        smears=None if smears is None else _smears_since(smears, which),
        seen=None if seen is None else rows(seen),
        active=None if active is None else rows(active),
        marks=tuple(_mark_at(one, which) for one in drawing.marks),
    )


def _contact_at(
    contact: Contact, which: np.ndarray, rows: Callable[[np.ndarray], np.ndarray]
) -> Contact:
    return replace(
        contact, **{one.name: rows(getattr(contact, one.name)) for one in fields(contact)}
    )


def _event_at(event: Event, period: float, which: np.ndarray) -> Event:
    """The event by the first sample that is there at its time or after it."""
    time = event.sample * period if event.time is None else event.time
    return replace(event, sample=_by(event.sample, which), time=time)


def _mark_at(mark: Mark, which: np.ndarray) -> Mark:
    return replace(mark, first=_by(mark.first, which), last=_by(mark.last, which))


def _by(sample: int, which: np.ndarray) -> int:
    return int(min(np.searchsorted(which, sample), len(which) - 1))


def _windows(which: np.ndarray) -> Sequence[slice]:
    """The samples since the one before, for each."""
    starts = [0, *(which[:-1] + 1).tolist()]
    return [slice(a, b + 1) for a, b in zip(starts, which.tolist(), strict=True)]


def _any_since(values: np.ndarray, which: np.ndarray) -> np.ndarray:
    return np.array([bool(np.any(values[one] > 0)) for one in _windows(which)])


def _smears_since(smears: np.ndarray, which: np.ndarray) -> np.ndarray:
    found = np.full((len(which), 2), np.nan, smears.dtype)
    for i, one in enumerate(_windows(which)):
        known = smears[one][np.isfinite(smears[one]).all(axis=1)]
        if len(known):
            found[i] = known[:, 0].min(), known[:, 1].max()
    return found
