"""The API pages show every public name, with a docstring."""

import re

import pytest

from tests.documents import ROOT

PACKAGES = sorted(
    name
    for page in (ROOT / "docs" / "api").glob("*.md")
    for name in re.findall(r"(?m)^::: (.+)$", page.read_text(encoding="utf-8"))
)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The sources as mkdocstrings reads them."""
    hooks = pytest.importorskip("documentation.hooks", reason="needs the extra docs")
    griffe = pytest.importorskip("griffe", reason="needs the extra docs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hooks, "PACKAGE", tmp_path_factory.mktemp("sources"))
        hooks.on_startup()
        yield griffe.load(
            "stickslip",
            search_paths=[hooks.PACKAGE],
            resolve_aliases=True,
            allow_inspection=False,
            extensions=griffe.load_extensions(ROOT / "documentation" / "docstrings.py"),
        )


def test_each_layer_and_each_machine_has_a_page():
    layers = {f"stickslip.{layer}" for layer in ("dynamics", "optim", "envs", "agents")}
    assert {*PACKAGES} == layers | {"stickslip.dynamics.biped", "stickslip.dynamics.ugv"}


@pytest.mark.parametrize("name", PACKAGES)
def test_a_page_shows_every_public_name_and_method(name, package):
    """mkdocstrings leaves out what has no docstring; a method may have its base class's."""
    module = package[name.partition(".")[2]]
    assert module.exports
    for each in module.exports:
        shown = module.members[str(getattr(each, "name", each))]
        shown = shown.final_target if shown.is_alias else shown
        assert shown.docstring, shown.path
        for method in public_methods(shown):
            told = [base.members.get(method.name) for base in shown.mro()]
            assert method.docstring or any(one and one.docstring for one in told), method.path


def public_methods(shown) -> list:
    """A class's methods, those of its base classes with them; nothing of anything else."""
    members = shown.all_members.values() if shown.is_class else ()
    return [one for one in members if one.is_function and not one.name.startswith("_")]
