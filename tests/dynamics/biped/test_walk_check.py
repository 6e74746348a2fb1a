"""One's own walk at a setting beside the event-exact one."""

import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedState, Setting, check_walk
from stickslip.dynamics.biped.walk_check import Path, walk_errors
from stickslip.dynamics.status import Status
from tests.dynamics.biped.helpers import default_params, state_of

COARSE = Setting("table", "rk4_split", 0.01, "float64")
SLIPPERY = Scene.uniform(0.06, 0.05)
SECONDS = 0.5


def test_errors_count_while_the_reference_is_inside_and_an_early_end_is_infinitely_wrong():
    true = Path(np.zeros((4, 3)), np.zeros((4, 3)), np.array([[0, 1, 3]] * 4))
    angle = np.array([[0.1, 0.2, 9.0], [0.1, 0.2, 9.0], [0.1, np.nan, 0.0], [0.0, 0.0, 9.0]])
    own = Path(angle, -angle, np.array([[0, 0, 0], [0, 3, 3], [0, 1, 1], [0, 0, 0]]))
    turned, slid = walk_errors(own, true)
    np.testing.assert_array_equal(turned, [0.2, np.inf, np.inf, 0.0])
    np.testing.assert_array_equal(slid, turned)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"params": 0.03}, ("params = 0.03", "BipedParams")),
        ({"setting": "fats"}, ("'fats' is unknown", "did you mean fast?")),
        ({"duration": 0.0}, ("duration = 0.0",)),
        ({"period": -1.0}, ("period = -1.0",)),
        ({"torque": np.zeros(7), "period": 0.02}, ("torque has shape (7,)", "25 steps")),
        ({"torque": np.zeros((2, 25)), "period": 0.02}, ("torque has shape (2, 25)",)),
        ({"state": BipedState(crank_rate=np.ones(3))}, ("crank_rate has shape (3,)",)),
        ({"scene": Scene.grip(), "state": BipedState(foot_velocity=0.1)}, ("foot_velocity",)),
    ],
)
def test_bad_questions_are_refused(changes, words):
    given = {
        "params": default_params("float32"),
        "scene": SLIPPERY,
        "state": BipedState(crank_rate=3.0),
        "torque": 0.5,
        "duration": SECONDS,
    } | changes
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        check_walk(**given)
    assert all(word in str(caught.value) for word in words)


def test_a_walk_has_an_error_at_its_setting():
    start = state_of("float32", phase=2.0, crank_rate=4.0, foot_velocity=0.05)
    torque = np.linspace(0.2, 0.6, 25)
    found = check_walk(default_params("float32"), SLIPPERY, start, torque, SECONDS, COARSE)
    assert 0 < found.angle_error < 1e-4
    assert 0 < found.slide_error < 1e-5
    assert found.status <= Status.SLIP_ONSET
