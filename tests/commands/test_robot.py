"""`stickslip robot`: templates, the chapter's numbers, pictures, and files that will not do."""

import numpy as np
import pytest

from stickslip.cli import main
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.ugv import UGVParams
from tests.asked import tells
from tests.trees import assert_same

pytest.importorskip("matplotlib", reason="needs the extra viz")


def test_templates_are_the_default_machines(tmp_path):
    for machine, usual in (("biped", BipedParams.from_bars()), ("ugv", UGVParams())):
        path = tmp_path / f"{machine}.toml"
        assert main(["robot", "--new", "--machine", machine, str(path)]) == 0
        assert_same(type(usual).from_file(path), usual, 1e-6)
        before = path.read_text()
        assert main(["robot", "--new", str(path)]) == 2
        assert main(["robot", str(path), "--mu", "0.1", "nan"]) == 2
        assert path.read_text() == before


def test_the_reference_robot_has_the_chapters_numbers(tmp_path, capsys):
    path = tmp_path / "my.toml"
    path.write_text('machine = "biped"\n')
    found = tells(capsys, "robot", str(path), "--mu", "0.02")
    assert found["facts"]["start torque"].startswith("0.84")
    friction = {row["rate"]: row["least_friction"] for row in found["friction"]}
    assert friction[3.0] == pytest.approx(0.08, abs=5e-4)
    (fastest,) = found["fastest"]
    assert fastest["constant_rate"] == pytest.approx(1.53, abs=0.02)
    assert fastest["best_gait"] > 5.5  # the README's gait at a friction of 0.02
    assert path.with_suffix(".png").stat().st_size > 10_000


@pytest.mark.long
def test_a_vehicle_climbs_what_friction_and_motors_let_it(tmp_path, capsys):
    path = tmp_path / "van.toml"
    path.write_text('machine = "ugv"\n[motor]\ntorque_limit = "150 N m"\n')
    found = tells(capsys, "robot", str(path), "--mu", "0.1", "0.9")
    slippery, firm = (row["steepest_slope"] for row in found["slopes"])
    assert slippery == pytest.approx(0.1, abs=1e-3)  # the slope itself, whatever the posture
    strongest = 2 * 150 / (0.28 * UGVParams().weight)  # sin of the slope that both motors hold
    assert abs(np.sin(np.arctan(firm)) - strongest) < np.diff(np.linspace(0, 1, 21))[0]
