"""The notebooks run as they stand, in a kernel of their own, and hold no outputs."""

import json
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted(ROOT.glob("notebooks/*.ipynb"))
QUICK = "1_first_walk"
FEWER = {
    "TIMESTEPS = 2_000_000": "TIMESTEPS = 65_536",
    "EPISODES = 16": "EPISODES = 2",
    "BUDGET = 2_000": "BUDGET = 300",
}
"""What a test makes less of."""


def notebook(path: Path):
    """Named, and a long one but for the first."""
    return pytest.param(path, id=path.stem, marks=[] if path.stem == QUICK else [pytest.mark.long])


@pytest.mark.parametrize("path", [notebook(path) for path in NOTEBOOKS])
def test_a_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    text = path.read_text(encoding="utf-8")
    for much, little in FEWER.items():
        text = text.replace(much, little)
    found = nbformat.reads(text, as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(found, timeout=600, kernel_name="python3", resources=resources).execute()
    assert any(cell.get("outputs") for cell in found.cells)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs(path: Path):
    content = json.loads(path.read_text(encoding="utf-8"))
    code = [cell for cell in content["cells"] if cell["cell_type"] == "code"]
    assert code
    for cell in code:
        assert cell["outputs"] == []
        assert cell["execution_count"] is None
        assert cell["metadata"] == {}


def test_what_the_site_shows_of_a_notebook_came_of_the_code_that_it_has():
    """Else: make notebooks."""
    from documentation.executed import KEPT, cells_of

    for path in NOTEBOOKS:
        code = [cell for cell in cells_of(path) if cell["kind"] == "code"]
        kept = json.loads((KEPT / f"{path.stem}.json").read_text(encoding="utf-8"))["cells"]
        assert [cell["source"] for cell in code] == [cell["source"] for cell in kept]
        outputs = [one for cell in code for one in cell["outputs"]]
        assert len(outputs) >= 4
        assert all((KEPT / one["picture"]).is_file() for one in outputs if "picture" in one)


def test_there_are_notebooks_and_what_is_made_less_stands_in_one_of_them():
    assert len(NOTEBOOKS) >= 4
    texts = [path.read_text(encoding="utf-8") for path in NOTEBOOKS]
    assert [sum(much in text for text in texts) for much in FEWER] == [1] * len(FEWER)
