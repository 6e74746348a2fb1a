"""What README and docs name is there: files, headings, modules, Python names."""

import builtins
import importlib.util
import re
from pathlib import Path

import pytest

from tests.documents import ROOT, documents

DOCUMENTS = [*documents(), ROOT / "SECURITY.md"]
TEXTS = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in DOCUMENTS}

FOLDERS = ("dynamics", "optim", "envs", "agents", "src")
SOURCE = "".join(
    path.read_text(encoding="utf-8") for of in FOLDERS for path in (ROOT / of).rglob("*.py")
)

FOLDER = "tests|benchmarks|docs|documentation|notebooks|" + "|".join(FOLDERS)


def found(pattern: str) -> list[tuple[str, str]]:
    """Document and match, each once."""
    return sorted({(of, one) for of, text in TEXTS.items() for one in re.findall(pattern, text)})


def anchors(path: Path) -> set[str]:
    """What links may name of a page: its headings, as GitHub and MkDocs spell them."""
    heads = re.findall(r"(?m)^#+ (.+)$", path.read_text(encoding="utf-8"))
    plain = (re.sub(r"[^\w\s-]", "", head.lower()).strip() for head in heads)
    return {re.sub(r"[-\s]+", "-", head) for head in plain}


@pytest.mark.parametrize(("document", "link"), found(r"\]\(((?!\w+:)[^)\s]+)\)"))
def test_a_link_leads_to_a_file_and_to_a_heading_of_it(document: str, link: str):
    name, _, anchor = link.partition("#")
    path = (ROOT / document).parent.joinpath(name) if name else ROOT / document
    assert path.exists()
    assert not anchor or anchor in anchors(path)


@pytest.mark.parametrize(("document", "path"), found(rf"`((?:{FOLDER})/[\w./*]+)`"))
def test_a_path_that_is_named_is_there(document: str, path: str):
    assert list(ROOT.glob(path))


@pytest.mark.parametrize(("document", "module"), found(r"python -m (benchmarks(?:\.[a-z_]+)+)"))
def test_a_module_that_is_run_is_there(document: str, module: str):
    assert importlib.util.find_spec(module) is not None


@pytest.mark.parametrize(("document", "name"), found(r"`([A-Z][a-z]\w*|[A-Z]\w*[a-z]\w*)[`.(]"))
def test_a_class_that_is_named_is_there(document: str, name: str):
    assert hasattr(builtins, name) or re.search(
        rf"(?m)^(?:class {name}\b|{name}(?:: TypeAlias)? = )", SOURCE
    )


@pytest.mark.parametrize("document", [one for one in TEXTS if one.startswith("docs/")])
def test_a_page_opens_with_a_command_or_a_snippet(document: str):
    """Before its first section; a list of terms and a history have none."""
    opening = TEXTS[document].partition("\n## ")[0]
    assert "\n```" in opening or document in ("docs/changelog.md", "docs/glossary.md")
