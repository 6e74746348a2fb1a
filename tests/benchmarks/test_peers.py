"""What other programs are given is the mechanism of our own equations."""

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from benchmarks.peers import __main__ as command
from benchmarks.peers.mjcf import LOOPS, RADIUS, SLOT, TREE, Settings, mechanism, mjcf
from benchmarks.peers.programs import CASES, error_of
from benchmarks.report import MARKS
from stickslip.dynamics.biped import BODIES, BipedParams

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]


@pytest.fixture
def machine(float64):
    return mechanism(BipedParams.from_bars(payload=2.0))


def test_the_tree_and_the_loops_have_every_pin_of_the_mechanism():
    pins = [frozenset((one, other)) for one, other, _ in (*TREE, *LOOPS)]
    # 16 pins and a slot a leg, and the crank's on the hip
    assert len(pins) == len(set(pins)) == 2 * 17 + 1
    assert sorted(body for body, _, _ in TREE) == sorted({*BODIES} - {"1"})
    hinges, slots = len(TREE), sum(pin == SLOT for _, _, pin in TREE)
    assert hinges + slots - 2 * len(LOOPS) == 1  # one motor moves it all


def bodies_of(text: str):
    """(name, place of the frame, inertial element) of every body, frames added up."""

    def walk(element, origin):
        for body in element.findall("body"):
            place = origin + np.array([float(word) for word in body.get("pos").split()])
            yield body.get("name"), place, body
            yield from walk(body, place)

    yield from walk(ElementTree.fromstring(text).find("worldbody"), np.zeros(3))


def test_mjcf_puts_every_mass_where_the_kinematics_do(machine):
    found = {name: (place, body) for name, place, body in bodies_of(mjcf(machine, Settings()))}
    assert set(found) == {f"link{name}" for name in BODIES}
    total = 0.0
    for index, name in enumerate(BODIES):
        place, body = found[f"link{name}"]
        inertial = body.find("inertial")
        centre = place + np.array([float(word) for word in inertial.get("pos").split()])
        np.testing.assert_allclose(centre[[0, 2]], machine.centre[index], atol=1e-14)
        assert float(inertial.get("diaginertia").split()[1]) == machine.inertia[index]
        total += float(inertial.get("mass"))
    assert total == pytest.approx(machine.total_mass, rel=1e-14)


def test_mjcf_closes_every_loop_at_its_pin(machine):
    text = mjcf(machine, Settings())
    frames = {name: place for name, place, _ in bodies_of(text)}
    connects = ElementTree.fromstring(text).findall("equality/connect")
    assert len(connects) == 12
    for connect, (one, other, pin) in zip(connects, LOOPS, strict=True):
        assert (connect.get("body1"), connect.get("body2")) == (f"link{one}", f"link{other}")
        anchor = np.array([float(word) for word in connect.get("anchor").split()])
        place = frames[f"link{one}"] + anchor
        np.testing.assert_allclose(place[[0, 2]], machine.pin(pin, one), atol=1e-14)


def test_mjcf_foot_is_fixed_on_grip_and_touches_the_floor_with_friction(machine):
    grip = ElementTree.fromstring(mjcf(machine, Settings()))
    assert grip.findall(".//geom") == []
    assert grip.find("worldbody/body/joint") is None
    rough = ElementTree.fromstring(mjcf(machine, Settings(), friction=0.4))
    foot = rough.find("worldbody/body")
    assert len(foot.findall("joint")) == 3
    for ball in foot.findall("geom"):
        assert float(ball.get("pos").split()[2]) == RADIUS == float(ball.get("size"))
    assert all(geom.get("friction") == "0.4 0 0" for geom in rough.findall(".//geom"))


def test_the_page_has_the_fastest_settings_that_meet_each_bound():
    content = json.loads((ROOT / command.RESULTS).read_text(encoding="utf-8"))
    page = (ROOT / command.DOCUMENT).read_text(encoding="utf-8")
    assert f"{MARKS[0]}\n{command.body(content)}\n{MARKS[1]}" in page
    row = {"program": "MuJoCo", "case": "stick", "setting": "RK4, 1 ms", "batch": 1}
    pairs = [(1e-1, 90.0), (5e-3, 9.0), (9e-3, 11.0), (1e-5, 1.0)]
    (line,) = command.at_bounds([row | {"error": e, "core_rate": rate} for e, rate in pairs])
    assert line["0.01 rad"] == "11 (RK4, 1 ms)"
    assert line["1e-06 rad"] == "not reached (1.0e-05)"
    assert error_of([1.0, np.nan], [1.0, 1.0]) == np.inf


def test_mujoco_walks_as_we_do(float64):
    pytest.importorskip("mujoco")
    from benchmarks.peers.programs import Engine

    settings = Settings(0.79 / 800, "RK4", (0.5 * 0.79 / 800, 1.0))
    found = Engine(CASES[0], settings).run(np.array([1.0]))[0]
    # exact functions, float64, steps of 0.1 ms (benchmarks.peers.programs.reference)
    assert found[4] == pytest.approx(2.91477155, abs=1e-5)
    assert found[-1] == pytest.approx(4.49633265, abs=2e-4)
