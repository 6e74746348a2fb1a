"""No recorded point of the biped's instances owes its value to the setting."""

import pytest

from benchmarks.optimisers.finer import LIMIT, names, owed_by
from stickslip.optim import instance


@pytest.mark.long
@pytest.mark.parametrize("name", names())
def test_a_recorded_point_is_worth_what_it_is_worth_in_a_sixteenth_of_the_step(name):
    owed = owed_by(instance(name))
    assert owed.value <= LIMIT
    assert owed.margin <= LIMIT
