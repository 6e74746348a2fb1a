"""What mkdocs calls while it builds: generated pages, and generated parts of written ones."""

from __future__ import annotations

from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from documentation import executed, inserts, notebooks, reference, tables


def on_startup(**kwargs: Any) -> None:
    """Lay out what mkdocstrings reads, before it looks for it."""
    reference.lay_out()


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the generated pages in the navigation."""
    generated = {
        "API": ["api.md", *reference.pages()],
        "Notebooks": [*notebooks.pages()],
    }
    config.nav = [_filled(entry, generated) for entry in config.nav or []]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages, and the notebooks themselves."""
    for path, text in {**reference.pages(), **notebooks.pages(), **inserts.pages()}.items():
        files.append(File.generated(config, path, content=text))
    for notebook in executed.files():
        place = f"notebooks/{notebook.name}"
        files.append(File.generated(config, place, abs_src_path=str(notebook)))
    return files


def on_page_markdown(markdown: str, page: Page, **kwargs: Any) -> str:
    """Put generated parts where a page asks for them."""
    return inserts.filled(markdown, "../" * page.file.src_uri.count("/"))


def on_page_content(html: str, **kwargs: Any) -> str:
    """Name the sources where they lie, and mark the cells of tables."""
    return tables.with_lengths(reference.with_real_paths(html))


def _filled(entry: Any, generated: dict[str, list[str]]) -> Any:
    if isinstance(entry, dict):
        return {name: generated.get(name, below) for name, below in entry.items()}
    return entry
