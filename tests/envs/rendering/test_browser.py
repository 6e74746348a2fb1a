"""Pages in headless Chromium: they load, play and obey, without an error and without a network."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from stickslip.envs.rendering.page import page_text
from tests.envs.rendering.frames import page
from tests.envs.rendering.test_page import evil_page

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

PIXELS = """
const canvas = document.querySelectorAll("canvas.picture")[arguments[0]];
return canvas.toDataURL();
"""

BAND = """
const strip = document.querySelector("canvas.strip");
const row = strip.getContext("2d").getImageData(0, strip.height / 2, strip.width, 1).data;
const orange = [];
for (let x = 0; x < strip.width; x++) if (row[4 * x] > 180 && row[4 * x + 2] < 80) orange.push(x);
return [orange[0] / strip.width, (orange[orange.length - 1] + 1) / strip.width];
"""


@pytest.fixture(scope="module")
def two() -> str:
    return page_text(page("one", "two"))


def time_of(browser: Chrome) -> float:
    return float(browser.execute_script("return document.querySelector('input[type=range]').value"))


def press(browser: Chrome, key: str, **more: Any) -> None:
    script = "document.dispatchEvent(new KeyboardEvent('keydown', arguments[0]))"
    browser.execute_script(script, {"key": key, "bubbles": True, **more})


def wait(browser: Chrome, condition: str) -> None:
    """Until a condition of the page holds, ten seconds at most."""
    script = """
const [condition, done] = [new Function(`return ${arguments[0]}`), arguments[1]];
const look = () => (condition() ? done(true) : setTimeout(look, 20));
look();
"""
    browser.set_script_timeout(10)
    browser.execute_async_script(script, condition)


def test_a_page_loads_without_an_error_or_a_request(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    assert browser.get_log("browser") == []
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
    counts = browser.execute_script(
        "return ['canvas.picture', '.uplot', 'canvas.strip', '.events li']"
        ".map((one) => document.querySelectorAll(one).length)"
    )
    assert counts == [2, 9, 2, 4]  # seven curves shared, two of several lines


def test_playing_moves_the_clock_and_the_pictures(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    before = [browser.execute_script(PIXELS, i) for i in (0, 1)]
    browser.execute_script("document.querySelector('button.play').click()")
    wait(browser, "document.querySelector('input[type=range]').value > 0.2")
    assert "Pause" in browser.execute_script("return document.querySelector('.play').textContent")
    press(browser, " ")
    assert "Play" in browser.execute_script("return document.querySelector('.play').textContent")
    after = [browser.execute_script(PIXELS, i) for i in (0, 1)]
    assert before[0] != after[0]
    assert before[1] != after[1]
    stood = time_of(browser)
    assert time_of(browser) == stood
    assert browser.get_log("browser") == []


def test_keys_step_and_jump_and_the_end_is_told(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    for key, more, time in (
        ("ArrowLeft", {}, 0.0),
        ("ArrowRight", {}, 0.02),
        ("ArrowRight", {"shiftKey": True}, 0.52),
        ("ArrowLeft", {}, 0.5),
        ("End", {}, 10.0),
        ("Home", {}, 0.0),
        ("ArrowLeft", {}, 0.0),
    ):
        press(browser, key, **more)
        assert time_of(browser) == pytest.approx(time, abs=1e-9)
    press(browser, "End")
    badge, spoken = browser.execute_script(
        "return ['.badge', '[aria-live]'].map((one) => document.querySelector(one).textContent)"
    )
    assert badge == "TOPPLED"
    assert "10.00 s" in spoken
    assert "toppled" in spoken
    press(browser, "+")
    assert browser.execute_script("return document.querySelector('select').value") == "2"


def test_an_event_is_a_way_to_its_moment(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    said = "return document.querySelectorAll('.events button')[1].textContent"
    assert browser.execute_script(said) == "3.00 s  sticks"
    browser.execute_script("document.querySelectorAll('.events button')[1].click()")
    assert time_of(browser) == pytest.approx(3.0)
    band = browser.execute_script(BAND)  # orange from 2 s to 3 s, of 10 s
    assert band == pytest.approx([0.2, 0.298], abs=0.003)


def test_a_name_runs_no_script(opened: Callable[..., Chrome]):
    browser = opened(page_text(evil_page()))
    assert browser.get_log("browser") == []
    shown = browser.execute_script("return document.querySelector('.card h2').textContent")
    assert "<script>alert(1)</script>" in shown
    assert browser.execute_script("return document.querySelectorAll('img').length") == 0
