"""What other programs are given is the mechanism of our own equations."""

import re
from xml.etree import ElementTree

import jax
import numpy as np
import pytest

from benchmarks.peers import c_loop, summary
from benchmarks.peers.cases import CASES, Measured, error_of, fastest
from benchmarks.peers.mechanism import LOOPS, SLOT, TREE, mechanism
from benchmarks.peers.mjcf import RADIUS, Settings, mjcf
from stickslip.dynamics.biped import BODIES, BipedParams, Table, kinematics, reduced_inertia

pytestmark = pytest.mark.long


@pytest.fixture
def machine(float64):
    return mechanism(BipedParams.from_bars(payload=2.0))


def measured(error: float, rate: float, program: str = "MuJoCo") -> Measured:
    return Measured(program, "stick", "RK4, 1 ms", 1, 1, error, rate, rate, rate, 0.0)


def test_the_tree_and_the_loops_have_every_pin_of_the_mechanism():
    pins = [frozenset((one, other)) for one, other, _ in (*TREE, *LOOPS)]
    # 16 pins and a slot a leg, and the crank's on the hip
    assert len(pins) == len(set(pins)) == 2 * 17 + 1
    assert sorted(body for body, _, _ in TREE) == sorted({*BODIES} - {"1"})
    hinges, slots = len(TREE), sum(pin == SLOT for _, _, pin in TREE)
    assert hinges + slots - 2 * len(LOOPS) == 1  # one motor moves it all


def test_the_tree_is_depth_first():
    path = ["1"]
    for body, parent, _ in TREE:
        assert parent in path
        path = [*path[: path.index(parent) + 1], body]


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


def test_every_pin_stays_where_it_is_in_both_its_bodies(float64):
    params = BipedParams.from_bars()
    place = jax.jit(kinematics)
    now, later = mechanism(params, 1.9), mechanism(params, 4.0)
    turns = [np.asarray(place(params, machine.crank_angle).angles) for machine in (now, later)]
    for one, other, pin in (*TREE, *LOOPS):
        if pin == SLOT:
            continue  # the stabiliser slides there
        owner = other if one == "13" else one
        for body in (one, other):
            index = BODIES.index(body)
            local = []
            for machine, turn in zip((now, later), turns, strict=True):
                c, s = np.cos(turn[index]), np.sin(turn[index])
                arm = machine.pin(pin, owner) - machine.centre[index]
                local.append([c * arm[0] + s * arm[1], c * arm[1] - s * arm[0]])
            np.testing.assert_allclose(*local, atol=1e-12, err_msg=f"{pin} of {body}")


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


def table_of(text: str) -> np.ndarray:
    """The numbers of TABLE in a C program."""
    body = text[text.index("TABLE[3]") : text.index("};")]
    values = [float.fromhex(word) for word in re.findall(r"-?0x[0-9a-fp.+-]+", body)]
    pieces, powers = (int(re.search(rf"{name} (\d+)", text)[1]) for name in ("PIECES", "POWERS"))
    return np.array(values).reshape(3, powers, pieces)


def test_c_source_holds_the_table_to_the_last_bit(float64):
    model = c_loop.table_model(Table(8, 5))
    table = table_of(c_loop.source(model, slides=False))
    np.testing.assert_array_equal(table.transpose(2, 0, 1), np.asarray(model.inertia.momenta))


def test_c_source_table_gives_the_inertia_functions(float64):
    model = c_loop.table_model(Table(8, 5))
    table = table_of(c_loop.source(model, slides=True))
    exact = jax.jit(reduced_inertia)(model.params, 2.5)
    place = (2.5 - np.pi / 2) * 8 / np.pi
    u = 2 * (place - int(place)) - 1
    values = [np.polynomial.polynomial.polyval(u, row) for row in table[:, :, int(place)]]
    np.testing.assert_allclose(values, [exact.M, exact.P, exact.Y], atol=1e-4)


@pytest.mark.skipif(c_loop.compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("name", ["stick", "slip"])
def test_c_loop_walks_as_we_do(float64, name):
    model = c_loop.table_model(Table(8, 5))
    loop = c_loop.Loop(model, name == "slip", c_loop.compiler())
    steps = 20
    torque = np.linspace(0.985, 1.005, c_loop.BLOCK)
    angles = loop.run(torque, c_loop.START[name], steps, c_loop.LENGTH[name] / steps)[0]
    assert np.all(np.diff(angles) > 0)
    assert angles[0] == pytest.approx(c_loop._own(model, name, steps), abs=1e-11)
    with pytest.raises(ValueError, match="multiple of"):
        loop.run(torque[:-1], c_loop.START[name], steps, 1e-3)


def test_the_fastest_setting_is_among_those_that_meet_the_bound():
    rows = [measured(1e-1, 90.0), measured(5e-3, 9.0), measured(9e-3, 11.0), measured(1e-5, 1.0)]
    assert fastest(rows, 1e-2) is rows[2]
    assert fastest(rows, 1e-6) is None
    (line,) = summary.at_bounds(rows, (1e-2, 1e-6))
    assert line["0.01 rad"].startswith("11; 11 (")
    assert line["1e-06 rad"] == "not reached (1.0e-05)"
    assert error_of([1.0, np.nan], [1.0, 1.0]) == np.inf
    assert {case.name for case in CASES} == {"stick", "stick-slip"}


def test_mujoco_walks_as_we_do(float64):
    pytest.importorskip("mujoco")
    from benchmarks.peers.mujoco_c import Engine

    settings = Settings(0.79 / 800, "RK4", (0.5 * 0.79 / 800, 1.0))
    found = Engine(CASES[0], settings).run(np.array([1.0]))[0]
    # exact functions, float64, steps of 0.1 ms (benchmarks.peers.cases.reference)
    assert found[4] == pytest.approx(2.91477155, abs=1e-5)
    assert found[-1] == pytest.approx(4.49633265, abs=2e-4)
