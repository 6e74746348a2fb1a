"""Axes of curves in headless Chromium: their words, and where these stand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.envs.rendering.html.document import page_text

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from selenium.webdriver import Chrome

RECORD = """
const words = new Map();
window.drawnWords = words;
const { clearRect, fillText } = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.clearRect = function (...where) {
  words.set(this.canvas, []);
  clearRect.apply(this, where);
};
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  if (!words.has(this.canvas)) words.set(this.canvas, []);
  const at = this.getTransform().transformPoint({ x, y });
  const wide = this.measureText(text).width;
  words.get(this.canvas).push({ text, x: at.x, y: at.y, align: this.textAlign, wide });
  fillText.call(this, text, x, y);
};
"""
WORDS = """
return [...document.querySelectorAll("#curves .chart")].map((chart) => {
  const canvas = chart.querySelector("canvas");
  const title = chart.querySelector("h2").textContent.trim();
  return [title, canvas.width, window.drawnWords.get(canvas)];
});
"""
RISE = np.linspace(0, 1, 30)
STEPS = np.linspace(0, 1e6, 30)


@dataclass
class Axis:
    """Words of ticks, the numbers that they say, where they stand and from where to where [px]."""

    words: list[str]
    numbers: np.ndarray
    places: np.ndarray
    spans: np.ndarray


def axis(words: list[dict], across: bool) -> Axis:
    said = [one["text"] for one in words]
    numbers = np.array([float(one.replace("−", "-").replace(",", "")) for one in said])
    places = np.array([one["x" if across else "y"] for one in words])
    share = [0.5 if one["align"] == "center" else 1 for one in words]
    left = np.array([one["x"] - part * one["wide"] for one, part in zip(words, share, strict=True)])
    return Axis(said, numbers, places, np.stack([left, left + [one["wide"] for one in words]], 1))


@pytest.fixture
def axes(browser: Chrome, opened: Callable[..., Chrome]):
    """The axes along and up of curves by their titles, and their canvas's width."""
    script = {"source": RECORD}
    known = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", script)

    def read(curves: tuple[Curve, ...], width: int = 1000) -> dict[str, tuple[Axis, Axis, int]]:
        shown = opened(page_text(Page("Curves", curves=curves)), width)
        found = {}
        for title, wide, words in shown.execute_script(WORDS):
            words = [one for one in words if one["text"] != "steps"]
            along = [one for one in words if one["align"] == "center"]
            up = [one for one in words if one["align"] == "right"]
            found[title] = (axis(along, True), axis(up, False), wide)
        assert shown.get_log("browser") == []
        return found

    yield read
    browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", known)


def curve(title: str, values: ArrayLike, x: ArrayLike = STEPS, log: bool = False) -> Curve:
    line = Line("one", np.asarray(values, float))
    return Curve("steps", np.asarray(x, float), Panel(title, "-", (line,)), log=log)


LEVEL = [0.7, 0.2, 0.9]
CURVES = (
    curve("close", 0.166 + 3e-4 * RISE),
    curve("tiny", 3e-9 * RISE - 1e-9),
    curve("small", 0.0071 + 2e-4 * RISE),
    curve("large", 7e6 + 1e6 * RISE),
    curve("thousands", 3e4 * RISE),
    curve("negative", -4e7 * RISE - 3e7),
    curve("single precision", np.float32(0.3) + np.float32(0.1) * RISE, x=np.float32(0.1) + RISE),
    curve("constant", np.full(30, -3e7)),
    curve("zero", np.zeros(30)),
    curve("least", 1e-310 * RISE),
    curve("greatest", 1e300 * RISE),
    curve("one", [2.5], x=[4096]),
    curve("none", np.full(30, np.nan)),
)
LOGARITHMIC = (
    curve("a fifth", LEVEL, x=np.array([0.05, 0.1, 0.2], np.float32), log=True),
    curve("narrow", LEVEL, x=[0.11, 0.13, 0.19], log=True),
    curve("wide", LEVEL, x=[1e-4, 1, 1e5], log=True),
    curve("widest", LEVEL, x=[1e-9, 1, 1e9], log=True),
    curve("one value", [0.5], x=[0.3], log=True),
)


@pytest.mark.parametrize("width", [390, 1000])
def test_words_say_where_they_stand_and_none_is_cut_off(axes: Callable, width: int):
    found = axes((*CURVES, *LOGARITHMIC), width)
    logarithmic = {one.panel.title for one in LOGARITHMIC}
    assert found.keys() == {one.panel.title for one in CURVES} | logarithmic
    for title, (along, up, wide) in found.items():
        for one, log in ((along, title in logarithmic), (up, False)):
            assert len({*one.words}) == len(one.words) >= 2, (title, one.words)
            assert one.spans.min() >= 0, (title, one.words)
            assert one.spans.max() <= wide, (title, one.words)
            with np.errstate(divide="ignore"):
                numbers = np.log(one.numbers) if log else one.numbers / np.abs(one.numbers).max()
            slope, start = np.polyfit(numbers, one.places, 1)
            assert slope * numbers + start == pytest.approx(one.places, abs=1.1), title
        assert (along.spans[1:, 0] - along.spans[:-1, 1] > 4).all(), (title, along.words)


def test_a_logarithmic_axis_ends_with_its_values(axes: Callable):
    found = axes(LOGARITHMIC)
    assert found["a fifth"][0].words == ["0.05", "0.1", "0.2"]
    narrow = found["narrow"][0].numbers
    assert 0.1099 < narrow.min() < narrow.max() < 0.1901
    assert found["widest"][0].numbers[[0, -1]] == pytest.approx([1e-9, 1e9])
    assert found["one value"][0].numbers == pytest.approx(0.3, rel=0.11)


def test_what_is_nowhere_negative_has_no_negative_axis(axes: Callable):
    near_zero = curve("near zero", 0.01 * RISE)
    found = axes((*CURVES, near_zero))
    assert found["zero"][1].words[0] == "0"
    assert found["near zero"][1].words[0] == "0"
    assert all(not word.startswith("−") for word in found["zero"][1].words)
    assert found["negative"][1].numbers.max() <= 0


def test_neither_roundings_nor_one_point_get_an_axis_of_their_own(axes: Callable):
    noise = 0.166 + 1e-7 * np.random.default_rng(0).random(30)
    found = axes((curve("noise", noise), curve("one", [2.5], x=[4096])))
    rounding, (along, up, _) = found["noise"][1], found["one"]
    assert np.ptp(rounding.numbers) > 0.01
    assert rounding.numbers == pytest.approx(0.166, rel=0.12)
    assert along.numbers == pytest.approx(4096, rel=0.1)
    assert up.numbers == pytest.approx(2.5, rel=0.1)
