"""What does not fit is refused before it exists, with the limit; the sizes are about the true."""

import numpy as np
import pytest

from stickslip.dynamics.checks import MEMORY_LIMIT
from stickslip.dynamics.ugv import Track
from stickslip.envs import UGVEnv
from stickslip.optim import PostureProblem, solve
from tests.optim.posture.helpers import over_bump

LONG = Track.from_points([0.0, 1e12], [0.0, 0.0], interpolation="linear")


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        (lambda: PostureProblem.along(Track.bump(), spacing=1e-9), "spacing = 1e-09 m from start"),
        (lambda: PostureProblem.along(LONG), r"makes 1e\+13 waypoints"),
        (lambda: UGVEnv().make_params(spacing=1e-12), "spacing = 1e-12 m from start"),
        (lambda: over_bump().objectives(np.broadcast_to(1.5, (2**24, 20))), "X of 16777216 points"),
        *(
            (lambda m=method, o=options: solve(over_bump(), m, **o), said)
            for method, options, said in (
                ("dp", {"angles": 10**6}, "angles = 1000000 x 1000000 at 10 waypoints"),
                ("cma", {"population": 10**9}, "population = 1000000000 of 20 numbers"),
            )
        ),
    ],
)
def test_what_does_not_fit_is_refused_before_it_exists(refused, said: str):
    with pytest.raises(ValueError, match=said) as refusal:
        refused()
    assert MEMORY_LIMIT in str(refusal.value)


@pytest.mark.parametrize(
    ("method", "options", "said"),
    [
        ("scp", {"start": np.full(20, 1.5)}, "method = 'scp' with 10 waypoints"),
        ("cma", {"start": np.full(20, 1.5), "population": 20}, "X of 20 points makes 32 members"),
        ("dp", {}, "polish = True with 10 waypoints"),
        ("dp", {"angles": 31, "polish": False}, "31 x 31 at 10 waypoints makes 9,610 stations"),
    ],
)
def test_the_limit_is_the_users(monkeypatch, method: str, options, said: str):
    problem = over_bump()
    monkeypatch.setenv(MEMORY_LIMIT, "2e5")
    with pytest.raises(ValueError, match=f"{said}.*accepted: what fits 2e\\+05 bytes"):
        solve(problem, method, **options)
