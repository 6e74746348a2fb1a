"""What README and docs name is there: files, modules, commands, Python names, examples."""

import builtins
import importlib.util
import re
import shlex
from pathlib import Path

import pytest

from stickslip.cli import make_parser

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
TEXTS = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in DOCUMENTS}

FOLDERS = ("dynamics", "optim", "envs", "agents", "src")
SOURCE = "".join(
    path.read_text(encoding="utf-8") for of in FOLDERS for path in (ROOT / of).rglob("*.py")
)


def found(pattern: str) -> list[tuple[str, str]]:
    """Document and match, each once."""
    return sorted(
        {(name, one) for name, text in TEXTS.items() for one in re.findall(pattern, text)}
    )


@pytest.mark.parametrize(("document", "link"), found(r"\]\(([^)#:]+)\)"))
def test_a_link_leads_to_a_file(document: str, link: str):
    assert (ROOT / document).parent.joinpath(link).exists()


@pytest.mark.parametrize(("document", "path"), found(r"`((?:tests|benchmarks|docs)/[\w./*]+)`"))
def test_a_path_that_is_named_is_there(document: str, path: str):
    assert list(ROOT.glob(path))


@pytest.mark.parametrize(("document", "module"), found(r"python -m (benchmarks(?:\.[a-z_]+)+)"))
def test_a_module_that_is_run_is_there(document: str, module: str):
    assert importlib.util.find_spec(module) is not None


@pytest.mark.parametrize(("document", "line"), found(r"(?m)^(?: {4})?(stickslip [a-z]+ [^\n|]*)$"))
def test_a_command_is_one_that_the_parser_takes(document: str, line: str):
    arguments = shlex.split(line, comments=True)[1:]
    assert callable(make_parser(arguments).parse_args(arguments).run)


@pytest.mark.parametrize(("document", "name"), found(r"`([A-Z][a-z]\w*|[A-Z]\w*[a-z]\w*)[`.(]"))
def test_a_class_that_is_named_is_there(document: str, name: str):
    assert hasattr(builtins, name) or re.search(
        rf"(?m)^(?:class {name}\b|{name}(?:: TypeAlias)? = )", SOURCE
    )


def test_examples_are_where_they_are_run():
    """By tests/test_readme.py, tests/test_recipes.py and tests/test_suite_page.py."""
    shown = {name for name, text in TEXTS.items() if "```python" in text}
    assert shown == {"README.md", "docs/training.md", "docs/suite.md"}
