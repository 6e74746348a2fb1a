"""What is said of a task holds at every point of a sweep."""

import pytest

from stickslip.agents.registry import machine_by_name
from stickslip.agents.sweeps.design import design_of
from stickslip.agents.sweeps.worded import worded
from stickslip.agents.tasks.places import every_option, places_of, read_named


def left(machine: str, who: str, axes: dict[str, str]):
    owner = machine_by_name(machine)
    options = dict.fromkeys(every_option()) | {"scenes": None}
    (place,) = places_of(read_named([who], owner), options, owner)
    env, design = next(iter(place.who.values())), design_of(axes, None, 0)
    return worded(owner, env, place.params, design, place.label, place.details)


@pytest.mark.parametrize(
    ("who", "axes", "label", "replaced"),
    [
        ("biped-ice", {"mu": "0.05:0.2:3"}, "6 rad/s", ("9 patches",)),
        ("biped-ice", {"mu": "0.05"}, "mu 0.05/0.05, 6 rad/s", ("9 patches",)),
        ("biped-ice", {"commanded_rate": "3:5:3"}, "9 patches", ("6 rad/s",)),
        ("biped-ice", {"slip_weight": "1:5:2"}, "9 patches, 6 rad/s", ()),
        ("crank-speed-pi", {"mu": "0.05:0.2:3"}, "", ("slippery",)),
    ],
)
def test_a_label_does_not_tell_of_what_an_axis_replaces(who, axes, label, replaced):
    found = left("biped", who, axes)
    assert (found.label, found.replaced) == (label, replaced)
    assert ("edges" in found.details) == ("9 patches" in label)
    assert ("commanded rate" in found.details) == ("commanded_rate" not in axes)


def test_details_lose_the_number_that_is_swept_and_a_scene_keeps_its_name():
    found = left("mass", "pull", {"mu": "0.1:0.3:2"})
    assert "mu patch 0.05" in found.details
    assert "mu 0.3" not in found.details
    assert found.label == "standard"


def test_values_that_no_task_has_are_left_to_those_who_say_so():
    assert left("biped", "crank-speed-pi", {"mu": "-1:0.2:3"}).label == "slippery"
