"""Generated parts of pages, where a page holds `<!-- site: NAME -->`, and whole pages of text."""

from __future__ import annotations

import re
from collections.abc import Callable

from documentation import fronts, reference
from documentation.names import ROOT
from stickslip.envs.tasks.known import known_of
from stickslip.envs.tasks.ladder import TASKS

PLACE = re.compile(r"<!-- site: (\w+) -->")
PAGE = re.compile(r"(?<!\[)`docs/(\w+)\.md`")
"""How pages name each other where they are read as files."""
NOTEBOOK = re.compile(r"\]\(\.\./notebooks/(\w+)\.ipynb\)")


def pages() -> dict[str, str]:
    """Markdown by path below docs."""
    return {"changelog.md": (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")}


def filled(markdown: str, up: str = "") -> str:
    """A page with its generated parts in their places, and links where it names other pages.

    up: the way from the page's folder to docs.
    """
    linked = PAGE.sub(lambda found: f"[{found[0]}]({up}{found[1]}.md)", markdown)
    linked = NOTEBOOK.sub(r"](notebooks/\1.md)", linked)
    return PLACE.sub(lambda place: INSERTS[place[1]](), linked)


def tasks() -> str:
    """What each task asks, and all numbers of its definition; scores stand in docs/tasks.md."""
    parts = []
    for name, task in TASKS.items():
        known = known_of(task)
        lines = [f"### {name}", "", f"{task.title[0].upper()}{task.title[1:]}. {task.about}", ""]
        lines += ["| | |", "| --- | --- |", f"| Gymnasium id | `{task.id}` |"]
        lines.append(f"| environment | [`{task.environment}`][{_class(task.environment)}] |")
        if known is not None:
            lines.append(f"| best known | {known.best.value:.4g} {task.unit}, {known.how} |")
        for key, value in {**task.choices, **task.parameters}.items():
            lines.append(f"| `{key}` | `{_plain(value)}` |")
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def citation() -> str:
    """CITATION.cff, where the checkout has one."""
    path = ROOT / "CITATION.cff"
    if not path.exists():
        return ""
    text = path.read_text(encoding="utf-8").strip()
    said = "`CITATION.cff` of the repository says the same in its own format:"
    return f"{said}\n\n```yaml\n{text}\n```"


def _class(name: str) -> str:
    return f"stickslip.envs.{name.removesuffix('Env').lower()}.env.{name}"


def _plain(value: object) -> str:
    """A value as text that a table's cell takes."""
    return str(value).replace("|", "\\|")


INSERTS: dict[str, Callable[[], str]] = {
    "tasks": tasks,
    "biped_fronts": fronts.biped,
    "ugv_fronts": fronts.ugv,
    "citation": citation,
    "api": reference.index,
}
"""What may be asked for; an unknown name ends the build."""
