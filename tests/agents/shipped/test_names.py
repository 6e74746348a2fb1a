"""Names of the package's policies, and what a name that is none brings."""

from __future__ import annotations

from pathlib import Path

import pytest

from stickslip.agents.policy.file import policy_path
from stickslip.agents.shipped.names import (
    FOLDER,
    policy_name,
    shipped_names,
    shipped_path,
    shipped_titles,
)


@pytest.mark.parametrize(
    ("task", "name"),
    [
        ("BipedIceSeen-v0", "biped-ice-seen-v0"),
        ("UGVLowGrip-v12", "ugv-low-grip-v12"),
        ("UGVBump-v1", "ugv-bump-v1"),
    ],
)
def test_a_name_follows_from_the_task(task: str, name: str):
    assert policy_name(task) == policy_name(name) == name


def test_the_latest_version_is_meant_unless_one_is_named(tmp_path: Path):
    for name in ("biped-ice-v2", "biped-ice-v10", "biped-ice-seen-v0", "ugv-hover-v0"):
        (tmp_path / f"{name}.npz").write_bytes(b"")
    assert shipped_names(tmp_path) == ("biped-ice", "biped-ice-seen", "ugv-hover")
    found = {one: shipped_path(one, tmp_path) for one in ("biped-ice", "biped-ice-v2")}
    assert [path and path.stem for path in found.values()] == ["biped-ice-v10", "biped-ice-v2"]
    assert shipped_path("BipedIce-v2", tmp_path) == tmp_path / "biped-ice-v2.npz"
    for other in ("biped-ice-v3", "biped", "./biped-ice", "../biped-ice", "biped-ice.npz", ""):
        assert shipped_path(other, tmp_path) is None
    assert "does not have" in shipped_titles(tmp_path)["ugv-hover"]


def test_a_path_is_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    name = shipped_names()[0]
    (tmp_path / name).mkdir()
    assert policy_path(name).parent == FOLDER
    assert policy_path(f"./{name}") == Path(name) / "policy.npz"
    assert policy_path(Path(name)) == Path(name) / "policy.npz"
