"""Headless Chromium for tests of pages."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


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
    """Show a page's text in a window of so many pixels, light or dark, still or moving."""

    def show(text: str, width: int = 1000, night: bool = False, moving: bool = False) -> Chrome:
        path = tmp_path / "page.html"
        path.write_text(text, encoding="utf-8")
        window = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 500}
        media = [
            {"name": "prefers-color-scheme", "value": "dark" if night else "light"},
            {"name": "prefers-reduced-motion", "value": "no-preference" if moving else "reduce"},
        ]
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", window)
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})
        browser.get_log("browser")  # of the page before
        browser.get(path.as_uri())
        return browser

    return show
