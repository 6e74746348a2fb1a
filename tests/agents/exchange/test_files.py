"""The files for other programs hold the mechanism of the package's own equations."""

from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.exchange.files import (
    CUT,
    FEET,
    HINGES,
    LOOPS,
    MOTOR,
    SLOT,
    TREE,
    joint_of,
    joints,
    mechanism,
    mjcf,
    name_of,
    urdf,
)
from stickslip.cli import OK, main
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BODIES, BipedParams, BipedState, kinematics, simulate
from stickslip.dynamics.biped.links import LINK_OF_BODY
from stickslip.optim.gait.footing import Footing
from tests.asked import prints, refusal
from tests.precision import mostly_single

START = np.pi / 2
RATE = 3.0
"""Crank rate of a walk [rad/s]."""


@pytest.fixture
def robot(float64):
    """One of its own: loaded, with one link that is no bar."""
    robot = BipedParams.from_bars(crank_length=0.04, payload=2.0, foot_mass=0.5, gravity=9.0)
    return robot.replace(
        mass=robot.mass.at[1].set(1.5), centre=robot.centre.at[1].set(jnp.array([0.2, 0.03]))
    )


def loaded(text: str):
    """Model and data in MuJoCo."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    return mujoco, model, mujoco.MjData(model)


def mass_of(robot, index: int) -> float:
    return float(robot.mass[LINK_OF_BODY[index]]) + (BODIES[index] == "13") * float(robot.payload)


def test_the_tree_and_the_loops_have_every_pin_of_the_mechanism():
    pins = [frozenset((one, other)) for one, other, _ in (*TREE, *LOOPS)]
    # 16 pins and a slot a leg, and the crank's on the hip
    assert len(pins) == len(set(pins)) == 2 * 17 + 1
    assert sorted(body for body, _, _ in TREE) == sorted({*BODIES} - {"1"})
    hinges, slots = len(TREE), sum(pin == SLOT for _, _, pin in TREE)
    assert hinges + slots - 2 * len(LOOPS) == 1  # one motor moves it all


def test_mujoco_has_the_masses_and_ten_poses_of_the_kinematics(robot):
    mujoco, model, data = loaded(mjcf(mechanism(robot), torque_limit=3.0))
    assert model.body_mass.sum() == pytest.approx(float(robot.total_mass), rel=1e-14)
    assert model.actuator(MOTOR).ctrlrange.tolist() == [-3.0, 3.0]
    bodies = [model.body(name_of(body)).id for body in BODIES]
    for index, body in enumerate(bodies):
        assert model.body_mass[body] == pytest.approx(mass_of(robot, index), rel=1e-14)
        assert model.body_inertia[body][1] == float(robot.inertia[LINK_OF_BODY[index]])
    pose, place = jax.jit(joints), jax.jit(kinematics)
    upright = place(robot, jnp.asarray(START)).angles
    for theta in np.linspace(START, 3 * START, 10):
        theta = jnp.asarray(theta)
        data.qpos[3:], data.qvel[3:] = pose(robot, theta, jnp.asarray(1.0))
        mujoco.mj_forward(model, data)
        placed = place(robot, theta)
        np.testing.assert_allclose(data.xipos[bodies][:, [0, 2]], placed.centres, atol=1e-14)
        turned = np.asarray(placed.angles - upright)
        rotations = data.xmat[bodies].reshape(-1, 3, 3)
        np.testing.assert_allclose(rotations[:, 0, 0], np.cos(turned), atol=1e-13)
        np.testing.assert_allclose(rotations[:, 2, 0], np.sin(turned), atol=1e-13)
        # the loops stay closed, and move closed
        assert data.ne == 3 * len(LOOPS)
        np.testing.assert_allclose(data.efc_pos[: data.ne], 0, atol=1e-14)
        np.testing.assert_allclose(data.efc_vel[: data.ne], 0, atol=1e-14)


@mostly_single
def test_a_pose_is_differentiated_in_both_precisions(dtype):
    robot = BipedParams.from_bars(dtype=dtype)
    theta, step = jnp.asarray(2.0, dtype), 1e-2
    pose = jax.jit(joints)
    places, rates = pose(robot, theta, jnp.asarray(1.0, dtype))
    assert places.dtype == rates.dtype == dtype
    after, before = (pose(robot, theta + move, 0 * theta)[0] for move in (step, -step))
    np.testing.assert_allclose(rates, (after - before) / (2 * step), atol=2e-4)


def test_the_robot_starts_with_the_torque_of_our_equations(float64):
    robot = BipedParams.from_bars()
    needed = Footing.of(robot).start_torque
    assert needed == pytest.approx(0.84, abs=0.01)
    for torque, starts in ((0.98 * needed, False), (1.02 * needed, True)):
        # the first foot alone touches, held fast: the start is a matter of work
        mujoco, model, data = loaded(mjcf(mechanism(robot), friction=None))
        data.ctrl[0], crank = torque, model.joint(joint_of("8")).qposadr[0]
        mujoco.mj_step(model, data, nstep=1100)
        assert (data.qpos[crank] > 2.0) == starts


@pytest.mark.parametrize(
    ("feet", "tolerance"),
    [
        # soft contacts and loops at a time step of 1 ms: 2e-3 rad, and 4e-4 at a quarter of it
        (("1",), 3e-3),
        # the swinging foot's heel dips 0.34 mm below the floor, from 0.75 rad before the exchange
        # on: it strikes, brakes the crank and tips the foot by 1 mrad, at any time step
        pytest.param(FEET, 0.05, marks=pytest.mark.long),
    ],
)
@pytest.mark.long
def test_a_second_of_walking_without_slip_is_ours(float64, feet, tolerance):
    robot, friction = BipedParams.from_bars(), 0.5  # 0.08 suffices at this rate
    law = lambda rate: 2.0 * (RATE - rate)  # noqa: E731
    start, floor = BipedState(crank_rate=RATE), Scene.uniform(friction)
    ours = simulate(
        robot, floor, start, lambda s: law(s.crank_rate), 1.0, 1e-3, integrator="rk4_split"
    )
    assert float(jnp.max(jnp.abs(ours.states.foot_position))) == 0.0
    mujoco, model, data = loaded(mjcf(mechanism(robot), friction=friction, feet=feet))
    crank = model.joint(joint_of("8")).qposadr[0]
    data.qvel[3:] = jax.jit(joints)(robot, jnp.asarray(START), jnp.asarray(RATE))[1]
    angles = [START]
    for _ in range(1000):
        data.ctrl[0] = law(data.qvel[crank])
        mujoco.mj_step(model, data)
        angles.append(START + data.qpos[crank])
    np.testing.assert_allclose(angles, ours.states.crank_angle, atol=tolerance)
    assert angles[-1] > 4.0


def test_urdf_is_a_tree_with_every_mass_and_names_what_it_leaves_out(robot):
    text = urdf(mechanism(robot), 3.0)
    root = ElementTree.fromstring(text)
    links = {link.get("name"): link for link in root.findall("link")}
    assert list(links) == [name_of(body) for body in BODIES]
    pairs = ((one.find("child"), one.find("parent")) for one in root.findall("joint"))
    parents = {child.get("link"): parent.get("link") for child, parent in pairs}
    assert set(links) - set(parents) == {"foot"}
    for name in links:  # every chain ends at the root
        chain = [name]
        while chain[-1] in parents:
            chain.append(parents[chain[-1]])
            assert len(chain) < len(links)
    for index, body in enumerate(BODIES):
        inertial = links[name_of(body)].find("inertial")
        assert float(inertial.find("mass").get("value")) == mass_of(robot, index)
        about = float(robot.inertia[LINK_OF_BODY[index]])
        assert {float(inertial.find("inertia").get(i)) for i in ("ixx", "iyy", "izz")} == {about}
    assert root.find("joint[@name='crank_pin']/limit").get("effort") == "3.0"
    assert len({frozenset((one, other)) for one, other, _ in (*HINGES, *CUT)}) == 2 * 17 + 1
    assert all(f"{name_of(one)} and {name_of(other)} at" in text for one, other, _ in CUT)


def test_mujoco_reads_the_urdf_with_every_link_in_its_place(robot):
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(urdf(mechanism(robot), 3.0))
    spec.compiler.fusestatic = False
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert (model.njnt, model.nbody) == (23, 25)
    assert model.body_mass.sum() == pytest.approx(float(robot.total_mass), rel=1e-14)
    bodies = [model.body(name_of(body)).id for body in BODIES]
    centres = kinematics(robot, START).centres
    np.testing.assert_allclose(data.xipos[bodies][:, [0, 2]], centres, atol=1e-14)


def test_the_command_writes_a_file_s_robot_and_replaces_nothing(tmp_path, capsys):
    toml, mujoco_file, tree = (str(tmp_path / name) for name in ("my.toml", "r.xml", "r.urdf"))
    assert main(["robot", "--new", toml]) == OK
    files = ["--mjcf", mujoco_file, "--urdf", tree]
    change = ["--set", "robot.payload=2", "motor.torque_limit=3", "--mu", "0.3"]
    said = prints(capsys, "export", toml, *files, *change)
    assert "static and kinetic friction are the same" in said
    assert "tibia and knee_link at" in said
    root = ElementTree.parse(mujoco_file).getroot()
    assert root.find("worldbody/geom").get("friction") == "0.3 0.0 0.0"
    assert root.find("actuator/motor").get("ctrlrange") == "-3.0 3.0"
    assert float(root.find(".//body[@name='hip']/inertial").get("mass")) == pytest.approx(2.7)
    for arguments, message in (
        ([toml, *files], "exists; accepted"),
        ([toml], "no file; accepted"),
        ([toml, "--out", "a.npz", "--mjcf", "b.xml"], "--out and --mjcf; accepted"),
        ([toml, "--mjcf", "r.txt"], "accepted: .xml"),
        ([toml, "--mjcf", "r.xml", "--urdf", "r.xml"], "accepted: two files"),
        ([toml, "--mjcf", "b.xml", "--mu", "-1"], "mu = -1.0 is not accepted"),
        (["biped-ice", "--out", str(tmp_path / "a.npz"), "--mu", "1"], "with a policy"),
    ):
        assert message in refusal(capsys, "export", *arguments)
    assert main(["export", toml, *files, "--overwrite"]) == OK


def test_a_vehicle_is_refused(tmp_path, capsys):
    toml = str(tmp_path / "van.toml")
    assert main(["robot", "--new", "--machine", "ugv", toml]) == OK
    assert "no counterpart" in refusal(capsys, "export", toml, "--mjcf", str(tmp_path / "van.xml"))
    assert not (tmp_path / "van.xml").exists()
