"""What is generated for the site: names, docstrings, fronts, drawings, links."""

import ast
import re
from html.parser import HTMLParser
from math import log10
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from documentation import drawing_biped, executed, fronts, inserts, names, notebooks, reference
from documentation.check import findings
from documentation.docstrings import as_markdown

ROOT = Path(__file__).parents[2]


def defined(path: str) -> bool:
    """Whether a dotted path's last part is written in its module, as a name of its own."""
    module, _, name = path.rpartition(".")
    if path in names.sources():
        return True
    for node in ast.parse(names.sources()[module].read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return True
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign):
            targets = [node.target]
        if any(ast.unparse(target) == name for target in targets):
            return True
    return False


def test_every_public_name_has_one_page_and_is_found_where_it_is_written():
    modules = names.public_modules()
    paths = [path for module in modules for path in module.origins.values()]
    assert len({*paths}) > 150
    assert [path for path in paths if not defined(path)] == []
    shown = "\n".join(reference.pages().values())
    documented = re.findall(r"(?m)^::: (\S+)$", shown)
    assert sorted(documented) == sorted({*paths})


def test_every_page_stands_in_the_navigation_and_no_warning_is_hushed():
    """Under --quiet MkDocs counts none, and its strict mode lets every one pass."""
    settings = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    named = re.findall(r"(?m)^ +- (?:\w.*: )?(\w+\.md)$", settings)
    written = {path.name for path in ROOT.glob("docs/*.md")} - {"api.md"}  # with its own pages
    assert sorted(named) == sorted(written | {"changelog.md"})
    (recipe,) = re.findall(r"(?m)^\t.*mkdocs\b(.*)$", (ROOT / "Makefile").read_text("utf-8"))
    assert "strict: true" in settings
    assert recipe.split() == ["build"]


def test_every_module_with_public_names_is_in_the_list():
    found = {
        name
        for name, file in names.sources().items()
        if re.search(r"(?m)^__all__ = ", file.read_text(encoding="utf-8"))
    } - {"stickslip.cli"}  # the command line's is no one's to import
    assert {module.name for module in names.public_modules()} == found
    assert all(f"[{name}](api/" in reference.index() for name in found)


def test_lines_set_in_are_code_tables_have_room_and_units_are_no_links():
    text = "Per step:\n  tracking + 1\n  slip - 2\nThen `x` [m] and [K] [m]:\n| a |\n| --- |"
    assert as_markdown(text).splitlines() == [
        "Per step:",
        "",
        "```text",
        "tracking + 1",
        "slip - 2",
        "```",
        "",
        "Then `x` \\[m\\] and \\[K\\] \\[m\\]:",
        "",
        "| a |",
        "| --- |",
    ]
    assert as_markdown("A [link](there).\n\n  x\n\n  y") == (
        "A [link](there).\n\n\n```text\nx\n\ny\n```\n"
    )


class Circles(HTMLParser):
    """The marks of a panel."""

    def __init__(self, text: str):
        super().__init__()
        self.found: list[dict[str, str | None]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "circle":
            self.found.append(dict(attrs))


def test_every_mark_of_the_fronts_stands_where_it_was_measured_and_tells_its_setting():
    marks = [
        fronts.Mark(1e-5, 1e-2, "cheap & rough", "a", True),
        fronts.Mark(1e-3, 1e-4, "dear", "b", True),
        fronts.Mark(1e-2, 1e-3, "beaten", "b", False),
    ]
    found = {one["data-about"]: one for one in Circles(fronts.panel("t", marks, "x", "y")).found}
    assert [*found] == ["beaten", "cheap & rough", "dear"]
    across = [float(str(found[mark.about]["cx"])) for mark in marks]
    apart = (across[1] - across[0]) / (log10(1e-3) - log10(1e-5))
    assert (across[2] - across[1]) == pytest.approx(apart, abs=0.1)
    assert ["tabindex" in found[mark.about] for mark in marks] == [mark.first for mark in marks]


def test_the_line_of_a_front_runs_to_what_is_dearer_and_more_accurate_and_styles_have_colours():
    """In whatever order the settings were measured."""
    style = (ROOT / "docs/site/site.css").read_text(encoding="utf-8")
    for shown in (fronts.biped(), fronts.ugv()):
        for line in re.findall(r'class="front-line" d="M([^"]+)"', shown):
            steps = re.findall(r"([\d.]+)(?: |V)([\d.]+)", line)
            assert steps == sorted(steps, key=lambda step: (float(step[0]), float(step[1])))
        assert {f".style-{n} " for n in re.findall(r"style-(\d+)", shown)} <= {
            f".style-{n} " for n in re.findall(r"\.style-(\d+) ", style)
        }


@pytest.mark.parametrize("shown", [fronts.biped, fronts.ugv])
def test_the_measurements_give_fronts(shown):
    found = Circles(shown()).found
    assert len(found) > 30
    assert 10 < sum("tabindex" in one for one in found) < len(found)
    assert all(one["data-about"] for one in found)


def test_the_drawing_of_a_leg_names_every_link_and_pin():
    figure = Figure()
    drawing_biped.leg(figure)
    texts = {one.get_text() for one in figure.findobj(Text)}
    assert {str(number) for number in range(1, 14)} <= texts
    assert {*"ABCDEFHKP"} <= texts


def test_drawings_are_small_and_of_letters_that_need_no_font():
    drawings = [*ROOT.glob("docs/machines/*.svg")]
    assert len(drawings) == 4
    for path in drawings:
        assert path.stat().st_size < 150_000
        assert "<text" not in path.read_text(encoding="utf-8")


def test_pages_link_to_each_other_and_to_notebooks():
    page = "See `docs/tasks.md`, [one](../notebooks/a_b.ipynb), [`docs/x.md`](x.md)."
    assert inserts.filled(page) == (
        "See [`docs/tasks.md`](tasks.md), [one](notebooks/a_b.md), [`docs/x.md`](x.md)."
    )


def test_a_notebook_is_a_page_with_its_code():
    pages = notebooks.pages()
    assert len(pages) == len(executed.files()) >= 4
    first = pages["notebooks/1_first_walk.md"]
    assert first.startswith("# A first walk")
    assert "```python\nimport gymnasium\n" in first
    assert "```text\nwalked 0." in first
    assert "](1_first_walk-3.png)" in first


def test_the_tasks_of_the_site_are_all_there_with_their_numbers():
    shown = inserts.tasks()
    assert "### BipedSteady-v0" in shown
    assert "`stickslip/UGVPatchyGrip-v1`" in shown
    assert "| `commanded_rate` | `6.5` |" in shown


def test_dead_links_and_what_would_be_fetched_are_found(tmp_path: Path):
    (tmp_path / "there.html").write_text('<h1 id="top">There</h1>', encoding="utf-8")
    (tmp_path / "page.html").write_text(
        '<a href="there.html#top">fine</a> <a href="there.html#gone">no anchor</a>'
        '<a href="gone.html">no file</a> <script src="https://cdn.example/x.js"></script>'
        '<a href="https://example.org">fine</a> <img src="gone.png">',
        encoding="utf-8",
    )
    (tmp_path / "a.css").write_text("@import url(https://fonts.example/a)", encoding="utf-8")
    assert sorted(findings(tmp_path)) == [
        "a.css would fetch something",
        "page.html: gone.html leads to no file",
        "page.html: gone.png leads to no file",
        "page.html: https://cdn.example/x.js would be fetched",
        "page.html: there.html#gone leads to no anchor",
    ]
