"""Pages in headless Chromium: they load, play and obey, without an error and without a network."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.envs.rendering.html.document import page_text
from tests.envs.rendering.html.pages import finer, page, walked
from tests.envs.rendering.html.test_document import evil_page

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PIXELS = """
const canvas = document.querySelectorAll("canvas.picture")[arguments[0]];
return canvas.toDataURL();
"""

BLUE = """
return [...document.querySelectorAll("#curves canvas")].map((canvas) => {
  const all = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 0; i < all.length; i += 4) {
    const [red, green, blue] = all.slice(i, i + 3);
    count += red < 40 && green > 80 && green < 150 && blue > 140;
  }
  return count;
});
"""

BAND = """
const strip = document.querySelector("canvas.strip");
const row = strip.getContext("2d").getImageData(0, strip.height / 2, strip.width, 1).data;
const orange = [];
for (let x = 0; x < strip.width; x++) if (row[4 * x] > 180 && row[4 * x + 2] < 80) orange.push(x);
return [orange[0] / strip.width, (orange[orange.length - 1] + 1) / strip.width];
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Chrome]:
    """Headless Chromium that keeps what its console says."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    found = [path for path in map(shutil.which, BROWSERS) if path]
    driver = shutil.which("chromedriver")
    if not found or driver is None:
        pytest.skip("no Chromium with its chromedriver: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = found[0]
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    made = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield made
    made.quit()


@pytest.fixture
def opened(browser: Chrome, tmp_path: Path) -> Callable[..., Chrome]:
    """Show a page's text in a window of so many pixels, by day or by night."""

    def show(text: str, width: int = 1000, night: bool = False) -> Chrome:
        path = tmp_path / "page.html"
        path.write_text(text, encoding="utf-8")
        window = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 500}
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if night else "light"}]
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", window)
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme})
        browser.get_log("browser")  # of the page before
        browser.get(path.as_uri())
        return browser

    return show


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
    assert counts == [2, 10, 2, 4]  # seven curves shared, two of several lines, one of its own
    places = browser.execute_script(
        "return [...document.querySelectorAll('#curves .u-axis')].length ? "
        "[...document.querySelectorAll('#curves h2')].map((one) => one.textContent.trim()) : []"
    )
    assert places == ["All episodes", "share"]


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


def test_scrubbing_to_the_slide_shows_it(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    scrub = (
        "const one = document.querySelector('input[type=range]'); one.value = arguments[0];"
        "one.dispatchEvent(new Event('input')); return document.querySelector('.badge').textContent"
    )
    assert browser.execute_script(scrub, 1.0) == "STICK"
    assert browser.execute_script(scrub, 2.5) == "SLIP"
    text = browser.execute_script("return document.querySelector('.time').textContent")
    assert text == "2.50 s of 10.00 s"


def test_a_curve_of_one_evaluation_shows_it(opened: Callable[..., Chrome]):
    one = Panel("return", "-", (Line("return", np.array([2.5])),))
    curves = (Curve("steps", np.array([4096.0]), one), page("x").curves[0])
    browser = opened(page_text(Page("Trained", episodes=(walked(),), curves=curves, over="Learnt")))
    assert all(count > 10 for count in browser.execute_script(BLUE))
    heading = "return document.querySelector('#curves h2').textContent"
    assert browser.execute_script(heading) == "Learnt"
    assert browser.get_log("browser") == []


def test_a_wheel_grips_where_a_foot_sticks(opened: Callable[..., Chrome]):
    wheel = replace(walked("wheel"), states=("GRIP", "SLIP"))
    browser = opened(page_text(Page("Both", episodes=(walked("foot"), wheel))))
    badges = "return [...document.querySelectorAll('.badge')].map((one) => one.textContent)"
    assert browser.execute_script(badges) == ["STICK", "GRIP"]


def test_a_thinned_episode_plays_to_its_end_and_says_so(opened: Callable[..., Chrome]):
    browser = opened(page_text(Page("Fine", episodes=(finer(walked(), 20),))))
    press(browser, "End")
    assert time_of(browser) == pytest.approx(10.0, abs=0.02)
    facts = browser.execute_script("return document.querySelector('.card .facts').textContent")
    assert "of 10,020 samples" in facts
    assert (
        browser.execute_script("return document.querySelector('.badge').textContent") == "TOPPLED"
    )
    assert browser.get_log("browser") == []


def test_an_event_is_a_way_to_its_moment(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    said = "return document.querySelectorAll('.events button')[1].textContent"
    assert browser.execute_script(said) == "2.9876 s  sticks"
    browser.execute_script("document.querySelectorAll('.events button')[1].click()")
    assert time_of(browser) == pytest.approx(2.9876)
    band = browser.execute_script(BAND)  # orange from 2 s to the instant, of 10 s
    assert band == pytest.approx([0.2, 0.29876], abs=0.003)


@pytest.mark.parametrize("width", [390, 1000])
def test_nothing_sticks_out_sideways(opened: Callable[..., Chrome], width: int):
    short = replace(walked(), name="short", period=0.001)  # over long before the other one
    browser = opened(page_text(replace(page("one"), episodes=(walked(), short))), width)
    press(browser, "End")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width


def test_night_by_the_system_and_by_the_button(opened: Callable[..., Chrome], two: str):
    browser = opened(two, night=True)
    colour = "return getComputedStyle(document.body).backgroundColor"
    dark, picture = browser.execute_script(colour), browser.execute_script(PIXELS, 0)
    browser.execute_script("document.getElementById('theme').click()")
    assert browser.execute_script(colour) == "rgb(255, 255, 255)" != dark
    assert browser.execute_script(PIXELS, 0) != picture
    press(browser, "d")
    assert browser.execute_script(colour) == dark
    assert browser.get_log("browser") == []


def test_everything_to_press_has_a_name(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    nameless = browser.execute_script(
        "return [...document.querySelectorAll('button, input, select, canvas, [role=img]')]"
        ".filter((one) => !one.getAttribute('aria-label') && !one.textContent.trim()"
        " && one.getAttribute('aria-hidden') !== 'true' && !one.closest('[role=img]')).length"
    )
    assert nameless == 0


def test_a_name_runs_no_script(opened: Callable[..., Chrome]):
    browser = opened(page_text(evil_page()))
    assert browser.get_log("browser") == []
    shown = browser.execute_script("return document.querySelector('.card h2').textContent")
    assert "<script>alert(1)</script>" in shown
    assert browser.execute_script("return document.querySelectorAll('img').length") == 0


def test_a_screenshot_is_no_blank(opened: Callable[..., Chrome], two: str):
    browser = opened(two)
    shot = base64.b64decode(browser.execute_cdp_cmd("Page.captureScreenshot", {})["data"])
    assert len(shot) > 30_000
