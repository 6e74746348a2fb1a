"""The reference robot as a design."""

import numpy as np
import pytest

from stickslip.optim import instance


@pytest.mark.long
def test_the_reference_robot_as_a_design_is_the_reference_robot():
    one = instance("design-biped-friction-d12-v1")
    value, feasible = one.value(np.ones(12))
    assert feasible
    assert value[0] == pytest.approx(0.0797, abs=5e-4)  # 0.08 at 3 rad/s in the chapter
    assert one.best_known < 0.7 * value[0]
