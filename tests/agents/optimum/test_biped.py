"""Dynamic programming on the biped's own step."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import ComputedTorque
from stickslip.agents.biped.state_map import BACKWARDS, FORWARDS, REST, state_map
from stickslip.agents.biped.task import from_anywhere
from stickslip.agents.evaluation.rollout import play
from stickslip.agents.evaluation.table import keep_of
from stickslip.agents.optimum import Ahead, Grid, Sheet, known, solve
from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv
from stickslip.envs.biped.params import Randomisation

ENV = BipedEnv(autoreset="disabled")


def coarse(params, cells: int = 12) -> Grid:
    """The usual grid with few nodes."""
    usual = state_map(ENV, params).grid(params)
    sheets = []
    for sheet in usual.sheets:
        axes = [
            replace(one, nodes=np.linspace(one.nodes[0], one.nodes[-1], cells + 1))
            for one in sheet.axes[:2]
        ]
        rest = [replace(one, nodes=one.nodes[::3]) for one in sheet.axes[2:]]
        sheets.append(Sheet(sheet.name, (*axes, *rest)))
    return Grid(tuple(sheets))


@pytest.fixture(scope="module")
def holding():
    """A floor that holds, episodes of 0.4 s: what compiles and computes quickly."""
    params = from_anywhere(ENV.make_params(scene=Scene.named("grip"), time_limit=0.4))
    return solve(ENV, params, grid=coarse(params, 24), actions=9, ahead=Ahead(2, 3))


@pytest.mark.parametrize("floor", ["slippery", "grip"])
def test_places_and_states_are_each_others_inverses(floor):
    params = ENV.make_params(scene=floor)
    states = state_map(ENV, params)
    grid = states.grid(params)
    for sheet in range(len(grid.sheets)):
        given = (2.0, 3.5, 0.05)[: len(grid.sheets[sheet].axes)]
        place = grid.place(sheet, *map(jnp.float32, given))
        again = states.place(grid, states.state(params, place))
        assert int(again.sheet) == sheet
        np.testing.assert_array_equal(again.coordinates, place.coordinates)
        assert not grid.cell(again).outside
    if floor == "slippery":  # rest and slides either way have a sheet each
        for sheet, sign in ((REST, 0), (FORWARDS, 1), (BACKWARDS, -1)):
            place = grid.place(sheet, *map(jnp.float32, (2.0, 3.0, 0.0)))
            velocity = float(states.state(params, place).biped.foot_velocity)
            assert np.sign(velocity) == sign
            assert abs(velocity) < 1e-4


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"scene": "ice-patch"}, "floor = Patches; accepted: Grip or Uniform"),
        ({"randomisation": Randomisation(mass=(0.9, 1.1))}, "mass is drawn"),
        ({"scene": "grip", "mark": 0.5, "mark_width": 0.07}, "a task with a mark"),
        ({"mean_rate": jnp.ones(3)}, "mean_rate has shape"),
    ],
)
def test_tasks_whose_rewards_depend_on_more_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        solve(ENV, ENV.make_params(**changes))


@pytest.mark.long
def test_the_policy_earns_what_the_grid_says_on_a_floor_that_holds(holding):
    found = known(holding, episodes=6, tolerance=0.15)
    assert found.holds
    assert found.upper_bound == pytest.approx(0.4)
    assert found.lower_bound <= found.upper_bound
    assert found.off_grid == 0


@pytest.mark.long
def test_at_six_radians_a_second_the_policy_stays_up_where_computed_torque_falls():
    scene = Scene.uniform(0.06, 0.05)
    params = from_anywhere(ENV.make_params(mean_rate=6.0, scene=scene))
    solution = solve(ENV, params, fineness=0.6, actions=31, ahead=Ahead(4, 4))
    found = known(solution, episodes=48)
    others = play(ENV, ComputedTorque(), params, range(48), keep_of)
    assert found.falls.value == 0
    assert np.mean(others.fell) > 0.05
    assert found.lower_bound > 8.6
    assert found.holds
