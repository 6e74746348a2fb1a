"""MkDocs hooks: the package's sources, notebooks as pages, links between pages."""

from __future__ import annotations

import base64
import json
import re
import shutil
import tomllib
import zlib
from html import unescape
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from stickslip.envs.rendering.page import html_of

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "build" / "reference"
"""Links to the sources in the layout of the installed package, for mkdocstrings."""
EPISODE = ROOT / "documentation" / "ice.json"
"""The viewer's data of the episode on the first page, compressed."""
NAMED_PAGE = re.compile(r"(?<!\[)`docs/(\w+)\.md`")
COLAB = "https://colab.research.google.com"
NOTEBOOK = re.compile(r"\]\(\.\./notebooks/(\w+)\.ipynb\)")


def on_startup(**kwargs: Any) -> None:
    """Link the sources before mkdocstrings looks for them."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    shutil.rmtree(PACKAGE, ignore_errors=True)
    for package, folder in table["tool"]["setuptools"]["package-dir"].items():
        place = PACKAGE.joinpath(*package.split("."))
        place.mkdir(parents=True)
        for file in (ROOT / folder).glob("*.py"):
            (place / file.name).symlink_to(file)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the viewer's page, and each notebook as a page and as a file."""
    files.append(File.generated(config, "site/ice.html", content=episode_page()))
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        page = f"notebooks/{path.stem}.md"
        content = notebook_page(path, config.extra["repository"])
        files.append(File.generated(config, page, content=content))
        copy = f"notebooks/{path.name}"
        files.append(File.generated(config, copy, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, **kwargs: Any) -> str:
    """Link the pages and notebooks that a page names."""
    up = "../" * page.file.src_uri.count("/")
    linked = NAMED_PAGE.sub(lambda found: f"[{found[0]}]({up}{found[1]}.md)", markdown)
    return NOTEBOOK.sub(r"](notebooks/\1.md)", linked)


def episode_page() -> str:
    """The viewer's page of the stored episode, in HTML."""
    stored = json.loads(EPISODE.read_text(encoding="utf-8"))
    data = zlib.decompress(base64.b64decode(stored["data"])).decode()
    return html_of(stored["title"], stored["lead"], data)


def store_episode(page: str) -> None:
    """Store the episode of a page that `stickslip view biped-ice --out PAGE` has written."""
    text = Path(page).read_text(encoding="utf-8")
    title, lead, data = (
        re.search(pattern, text, re.DOTALL)[1]  # type: ignore[index]
        for pattern in (r"<title>(.*?)<", r'class="lead">(.*?)</p>', r'id="data">(.*?)</script>')
    )
    packed = base64.b64encode(zlib.compress(data.encode(), 9)).decode()
    stored = {"title": unescape(title), "lead": unescape(lead), "data": packed}
    EPISODE.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")


def notebook_page(path: Path, repository: str) -> str:
    """Markdown of a notebook: badges, text, code and stored outputs; not the installing cell."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    title, *rest = [
        _cell(cell) for cell in cells if "install" not in cell["metadata"].get("tags", ())
    ]
    return "\n\n".join([title, badges(path, repository), *rest]) + "\n"


def badges(path: Path, repository: str) -> str:
    """Links that download a notebook and open it in Colab; without an address, Colab's upload."""
    download = f"[Download the notebook]({path.name}){{ .badge }}"
    if repository:
        address = f"{COLAB}/github/{repository}/blob/main/notebooks/{path.name}"
        return f"{download} [Open in Colab]({address}){{ .badge }}"
    return (
        f"{download} [Open Colab]({COLAB}){{ .badge }} and upload the notebook and a wheel there."
    )


def _cell(cell: dict[str, Any]) -> str:
    source = "".join(cell["source"]).strip()
    if cell["cell_type"] == "markdown":
        return source
    outputs = [one for one in cell["outputs"] if one.get("name") != "stderr"]
    shown = "\n\n".join([f"```python\n{source}\n```", *map(_output, outputs)])
    code, *texts = shown.split("\n```\n\n```text\n")
    return "\n```\n\n```text\n".join([code, "\n".join(texts)]) if texts else code


def _output(output: dict[str, Any]) -> str:
    data = output.get("data", {})
    if "image/png" in data:
        return f"![output of the cell above](data:image/png;base64,{data['image/png'].strip()})"
    text = "".join(output.get("text", data.get("text/plain", ""))).strip()
    return f"```text\n{text}\n```"
