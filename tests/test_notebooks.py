"""The notebooks run as they stand, in a kernel of their own."""

import json
import os
import tomllib
from pathlib import Path

import pytest

from tests.documents import ROOT

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
def test_a_notebook_is_stored_with_outputs_and_no_error(path: Path):
    """Else: make notebooks."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    outputs = [one for cell in cells for one in cell.get("outputs", ())]
    assert len(outputs) >= 4
    assert all(one["output_type"] != "error" for one in outputs)


def test_there_are_notebooks_and_what_is_made_less_stands_in_one_of_them():
    assert len(NOTEBOOKS) >= 4
    texts = [path.read_text(encoding="utf-8") for path in NOTEBOOKS]
    assert [sum(much in text for text in texts) for much in FEWER] == [1] * len(FEWER)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.parametrize("wheel", ["stickslip-0.2.0-py3-none-any.whl", None])
@pytest.mark.parametrize("there", [True, False])
def test_the_first_cell_installs_what_is_missing(
    path: Path, wheel: str | None, there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """From the wheel beside the notebook, or by name."""
    monkeypatch.chdir(tmp_path)
    if wheel:
        Path(wheel).touch()
    asked: list[list[str]] = []
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name if there else None)
    monkeypatch.setattr("subprocess.run", lambda words, check: asked.append(words))
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    exec(next("".join(one["source"]) for one in cells if one["cell_type"] == "code"), {})
    assert [words[-1].partition("[")[0] for words in asked] == [wheel or "stickslip"] * (not there)
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    for words in asked:
        names = words[-1].partition("[")[2].rstrip("]").split(",")
        assert {*names} <= {*extras["optional-dependencies"]}
