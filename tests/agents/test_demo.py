"""The demo: where it runs, and that its policies are good."""

import json
from pathlib import Path

import pytest

from stickslip.agents.demo import demo
from stickslip.agents.machine import machine_by_name, register, unregister
from stickslip.agents.training.directory import read_columns
from tests.agents.mass import MassMachine


def test_what_has_no_demo_is_refused_before_anything_is_written(tmp_path: Path):
    register(MassMachine())
    try:
        with pytest.raises(ValueError, match="'mass' has no demo; accepted: biped, ugv"):
            demo(tmp_path, machine="mass")
    finally:
        unregister("mass")
    with pytest.raises(ValueError, match=r"machine = 'uvg' is unknown.*'ugv'"):
        demo(tmp_path, machine="uvg")
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_the_demos_policy_is_well_below_the_best_posture_on_bumps_that_it_has_not_seen(
    tmp_path: Path,
):
    path = demo(tmp_path, machine="ugv")
    assert path == tmp_path / "demo-ugv"
    rows = {row["controller"]: row for row in json.loads((path / "table.json").read_text())["rows"]}
    found = {name: {k: v["value"] for k, v in r["metrics"].items()} for name, r in rows.items()}
    policy, posture = found["trained policy"], found["fixed-posture"]
    assert policy["failures"] == 0
    assert policy["cost"] < 0.85 * posture["cost"]
    machine = machine_by_name("ugv")
    for name in machine.demonstration().files(machine):
        assert (path / name).stat().st_size > 500
    steps = read_columns(path / "metrics.csv")["timesteps"]
    assert demo(tmp_path, machine="ugv") == path
    assert read_columns(path / "metrics.csv")["timesteps"] == steps
