"""The best split of torque is the best of the one-parameter family, and its bound is proved."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Track, UGVParams, ground_forces, pose
from stickslip.optim.result import OptimStatus
from stickslip.optim.torque_split import SPLIT_CRITERIA, Family, TorqueSplit
from tests.dynamics.ugv.helpers import chapter

PARAMS = UGVParams()
FRICTION = 0.6
TURNS = (-1.0, -1.3)
SLOPE = 0.3
ANGLES = ((1.2, 1.9), (1.0, 1.5), (2.2, 2.0))


def placed_on(track, x):
    """A pose for each x and each of ANGLES, in float64: [x, angles]."""
    with jax.enable_x64(True):
        return pose(PARAMS, track, jnp.asarray(x)[:, None], jnp.asarray(ANGLES))


@pytest.fixture(scope="module")
def postures():
    """On the bump, before, on and behind its top: [9]."""
    return jax.tree.map(lambda v: v.reshape(9, *v.shape[2:]), placed_on(Track.bump(), [3.3, 4, 5]))


@pytest.fixture(scope="module")
def family(postures):
    with jax.enable_x64(True):
        return Family.of(PARAMS, postures)


def test_a_posture_that_no_vehicle_can_take_is_refused():
    with pytest.raises(ValueError, match=r"wheel_clearance of -0.\d+ m; accepted: >= 0"):
        Family.of(PARAMS, pose(PARAMS, Track.bump(), 3.3, (0.7, 1.1)))


@pytest.fixture(scope="module")
def sloping():
    """On an endless slope, in the two of ANGLES that do not roll over there: [2]."""
    with jax.enable_x64(True):
        family = Family.of(PARAMS, placed_on(Track.incline(SLOPE), [3.0]))
    return Family(*(part[0, ::2] for part in family))


@pytest.fixture(scope="module")
def scanned(postures):
    """Forces of 200001 splits from -W to W for each posture: four arrays [splits, 9]."""
    with jax.enable_x64(True):
        difference = PARAMS.weight * jnp.linspace(-1, 1, 200001)[:, None]
        return [np.asarray(force) for force in ground_forces(PARAMS, postures, difference)]


def value_of(criterion, forces):
    """The criterion written out once more, of any shape."""
    F, N = np.stack([forces[0], forces[2]]), np.stack([forces[1], forces[3]])
    M = -F * PARAMS.wheel_radius
    turns = np.reshape(TURNS, (2, *([1] * (F.ndim - 1))))
    with np.errstate(all="ignore"):
        return {
            "friction_demand": lambda: np.where(N.min(0) > 0, np.max(abs(F) / N, 0), np.inf),
            "grip": lambda: -np.min(FRICTION * N - abs(F), 0),
            "peak_torque": lambda: np.max(abs(M), 0),
            "squared_torque": lambda: np.sum(M**2, 0),
            "positive_power": lambda: np.sum(np.maximum(M * turns, 0), 0),
            "normal_force": lambda: -np.min(N, 0),
        }[criterion]()


def held(forces):
    """Whether grip and normal forces allow these splits."""
    return (abs(forces[0]) <= FRICTION * forces[1]) & (abs(forces[2]) <= FRICTION * forces[3])


def solved(criterion, family, friction=FRICTION):
    turns = np.tile(TURNS, (len(family.equal), 1)) if criterion == "positive_power" else None
    return TorqueSplit(criterion).along(PARAMS, family, friction, turns)


@pytest.mark.parametrize("criterion", SPLIT_CRITERIA)
def test_no_split_of_a_dense_scan_is_better_than_the_one_found_or_below_its_bound(
    criterion, family, scanned
):
    everywhere = np.where(held(scanned), value_of(criterion, scanned), np.inf)
    for split, values in zip(solved(criterion, family), everywhere.T, strict=True):
        assert split.status is OptimStatus.OPTIMAL, split.message
        want = value_of(criterion, split.forces)
        np.testing.assert_allclose(split.value, want, rtol=1e-9, atol=1e-12)  # 0 to roundings
        size = max(abs(split.value), 1.0 if criterion == "friction_demand" else 1e3)
        assert np.min(values) >= split.lower_bound
        assert np.min(values) <= split.value + 1e-4 * size
        assert split.value - 1e-6 * size <= split.lower_bound <= split.value


@pytest.mark.parametrize("criterion", SPLIT_CRITERIA)
def test_the_forces_found_hold_the_vehicle_and_keep_the_limits(criterion, postures, family):
    with jax.enable_x64(True):
        rows, right = (np.asarray(part) for part in chapter(PARAMS, postures))
    for split, row, total in zip(solved(criterion, family), rows, right, strict=True):
        balance = row[6:, :4] @ np.array(split.forces) - total[6:]
        np.testing.assert_allclose(balance, 0, atol=1e-8)
        np.testing.assert_allclose(
            split.torques, -np.array(split.forces[::2]) * PARAMS.wheel_radius
        )
        assert split.feasible
        assert max(split.residuals.values()) < 1e-6
        assert held(np.array(split.forces) * [1, 1 + 1e-9, 1, 1 + 1e-9])


def test_on_a_slope_least_demand_is_its_tangent_and_least_torque_half_its_pull(sloping):
    """Sums over both wheels: F = W sin b, N = W cos b, whatever the split."""
    W, b = PARAMS.weight, np.arctan(SLOPE)
    pull = W * np.sin(b) * PARAMS.wheel_radius
    names = ("friction_demand", "peak_torque", "squared_torque")
    for demand, peak, square in zip(*(solved(n, sloping, 1.0) for n in names), strict=True):
        np.testing.assert_allclose(demand.value, SLOPE, rtol=1e-9)
        np.testing.assert_allclose(peak.value, pull / 2, rtol=1e-9)
        np.testing.assert_allclose(square.value, pull**2 / 2, rtol=1e-9)


def test_what_cannot_be_is_said_to_be_and_why(sloping):
    steep = Family(*(part[0] for part in sloping))
    cases = [
        (TorqueSplit("grip"), 0.2, ("grip at the rear wheel", "grip at the front wheel")),
        (TorqueSplit("friction_demand"), 0.2, ("grip", "0.3")),
        (
            TorqueSplit("peak_torque", min_normal=0.6 * PARAMS.weight),
            0.8,
            ("normal force of the front wheel",),
        ),
        (TorqueSplit("grip", max_torque=10.0), 0.8, ("torque of the",)),
    ]
    for solver, friction, names in cases:
        split = solver.solve(PARAMS, steep, friction)
        assert split.status is OptimStatus.INFEASIBLE
        assert not split.feasible
        assert all(name in split.message for name in names), split.message
        blamed = {name for name, excess in split.residuals.items() if excess > 0}
        assert any(name in split.message or name.startswith("grip") for name in blamed)


HOLLOW = Family([0.0017, 0.402, 0.0017, 0.598], [-0.5, 0.002, 0.5, 0.0018])
"""Wheels on opposite sides, in weights: pressed together they carry more."""
ROLLED = Family([0.29331727, 1.2140408, 0.29331727, -0.46933707],
                [-0.49968914, -0.03086062, 0.50031086, -0.01818379])  # fmt: skip
"""Rolled over at equal torques; holds from a difference of -26 weights on."""


def in_newtons(of: Family) -> Family:
    return Family(PARAMS.weight * np.array(of.equal), np.array(of.per_newton))


@pytest.mark.parametrize(
    ("criterion", "of", "friction"),
    [("normal_force", HOLLOW, None), ("grip", HOLLOW, 400.0), ("friction_demand", ROLLED, 0.8)],
)
def test_what_falls_without_end_has_no_best_split_and_a_motor_ends_it(criterion, of, friction):
    found = TorqueSplit(criterion).solve(PARAMS, in_newtons(of), friction)
    assert found.status is OptimStatus.FAILED
    assert "max_torque" in found.message
    assert found.lower_bound is None
    assert np.all(np.isfinite([*found.forces, found.value]))
    most = 100 * float(PARAMS.weight * PARAMS.wheel_radius)
    limited = TorqueSplit(criterion, max_torque=most).solve(PARAMS, in_newtons(of), friction)
    assert limited.lower_bound <= limited.value < found.value


def test_the_least_demand_is_that_of_a_dense_scan_wherever_the_wheels_stand():
    """On 40 pairs of slopes that nothing was tuned on, some with the weight beside the wheels."""
    random, solver = np.random.default_rng(52), TorqueSplit("friction_demand")
    d, proved = np.linspace(-40, 40, 400_001), 0
    for _ in range(40):
        rear, front = random.uniform(-1.2, 1.2, 2)
        (cr, sr), (cf, sf) = ([np.cos(b), np.sin(b)] for b in (rear, front))
        x, y, at = random.uniform(0.3, 2.0), random.uniform(-0.9, 0.9), random.uniform(-0.1, 1.1)
        held = [[cr, -sr, cf, -sf], [sr, cr, sf, cf],
                [0, 0, x * sf - y * cf, x * cf + y * sf], [-1, 0, 1, 0]]  # fmt: skip
        equal, more = np.linalg.solve(held, np.array([[0, 1, at * x, 0], [0, 1, at * x, 1]]).T).T
        per = more - equal
        found = solver.solve(PARAMS, in_newtons(Family(equal, per)), None)
        F, N = (np.outer(equal[i::2], 1 + 0 * d) + np.outer(per[i::2], d) for i in (0, 1))
        N = np.where(np.min(N, 0) > 0, N, np.nan)
        scanned = np.nanmin(np.append(np.max(np.abs(F) / N, 0), np.inf))
        if found.status is OptimStatus.OPTIMAL:
            assert found.lower_bound <= found.value <= scanned * (1 + 1e-12)
            proved += 1
        elif found.status is OptimStatus.INFEASIBLE:
            assert scanned == np.inf
        else:
            assert "max_torque" in found.message
    assert proved > 20


def test_bad_values_are_refused_by_name(family):
    one = Family(family.equal[0], family.per_newton[0])
    for make, words in (
        (lambda: TorqueSplit("speed"), "'friction_demand'"),
        (lambda: TorqueSplit("grip", min_normal=-1.0), "min_normal"),
        (lambda: TorqueSplit("grip").solve(PARAMS, one, None), "friction"),
        (lambda: TorqueSplit("grip").solve(PARAMS, one, -0.1), "friction"),
        (lambda: TorqueSplit("grip").solve(PARAMS, family), "one posture"),
        (lambda: TorqueSplit("positive_power").solve(PARAMS, one), "turns"),
        (lambda: TorqueSplit("grip").solve(PARAMS, one, 0.8, TURNS), "turns"),
        (lambda: TorqueSplit("grip").along(PARAMS, one), "accepted"),
    ):
        with pytest.raises(ValueError, match=words):
            make()
