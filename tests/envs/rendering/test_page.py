"""A page is one file that loads nothing, and what is written into it stays text."""

import base64
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from stickslip.envs.rendering.page import Page, page_text
from tests.envs.rendering.frames import page, walked
from tests.pages import read_episodes

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&"


class Elements(HTMLParser):
    """The elements of a page with their attributes."""

    def __init__(self, text: str):
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]):
        self.found.append((tag, dict(attrs)))


def evil_page() -> Page:
    return Page(EVIL, EVIL, (replace(walked(), name=EVIL, ended=EVIL, facts=((EVIL, EVIL),)),))


def test_ten_seconds_stay_far_below_two_megabytes():
    assert len(page_text(page("walker")).encode()) < 600_000
    assert len(page_text(page("a", "b", "c", "d")).encode()) < 2_000_000


def test_nothing_is_loaded_from_anywhere():
    text = page_text(page("walker"))
    for tag, attributes in Elements(text).found:
        for name in ("src", "href", "action", "data"):
            value = attributes.get(name)
            assert value is None or value.startswith("data:"), f"{tag} {name}={value}"
    assert not re.search(r"@import|url\(|\bfetch\(|XMLHttpRequest|import\(", text)


def test_only_the_two_scripts_of_the_package_are_allowed():
    text = page_text(evil_page())
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digests = {base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts}
    metas = [attributes for tag, attributes in Elements(text).found if tag == "meta"]
    (policy,) = (of["content"] for of in metas if "http-equiv" in of)
    assert policy is not None
    assert {*re.findall(r"'sha256-([^']+)'", policy)} == digests
    assert len(scripts) == 2
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy.partition("script-src")[2].partition(";")[0]


def test_names_cannot_bring_elements():
    same = Page("x", "x", (replace(walked(), name="x", ended="x", facts=(("x", "x"),)),))
    tags = [[tag for tag, _ in Elements(page_text(one)).found] for one in (same, evil_page())]
    assert tags[0] == tags[1]
    assert not any("onerror" in of for _, of in Elements(page_text(evil_page())).found)


def test_the_page_of_the_documentation_is_made_of_its_stored_episode(tmp_path, monkeypatch):
    """`documentation.hooks.store_episode` writes it anew."""
    hooks = pytest.importorskip("documentation.hooks")
    made = tmp_path / "page.html"
    made.write_text(hooks.episode_page(), encoding="utf-8")
    (episode,) = read_episodes(made)
    assert (episode.name, episode.drawing.points.shape) == ("biped-ice", (301, 25, 2))
    stored = hooks.EPISODE.read_text(encoding="utf-8")
    monkeypatch.setattr(hooks, "EPISODE", tmp_path / "ice.json")
    hooks.store_episode(made)
    assert hooks.EPISODE.read_text(encoding="utf-8") == stored
