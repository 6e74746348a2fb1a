"""Every constructor of vehicle, ground and solver refuses what is no number, by one rule."""

import re
from dataclasses import fields

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Odometer, PoseSolver, Track, UGVParams, equilibrium, pose
from stickslip.dynamics.ugv.ground.roughness import rough_shape, rough_waves

NO_NUMBERS = [10**400, "1.0", b"1", [], {}, 1j, object(), True, None, np.nan, np.inf,
              np.array(["1"]), np.array([]), [1.0, [2.0, 3.0]]]  # fmt: skip
NUMBERS = {
    "bump": ("height", "centre", "width", "start", "end"),
    "flat": ("start", "end"),
    "incline": ("slope", "end"),
    "sinusoid": ("amplitude", "wavelength"),
    "ramp": ("slope", "position", "length", "joint"),
    "step": ("height", "position", "length"),
    "ditch": ("depth", "position", "width", "side"),
    "rough": ("start", "end", "margin"),
}
NO_INTEGERS = [0, -1, 2.0, "3", b"3", True, None, [], 10**400, 10**12, object(), np.float64(2)]
X, ANGLES = 4.0, np.array([1.5, 1.5])


def refused(name, make):
    with pytest.raises(ValueError, match=rf"\b{re.escape(name)}\b.*accepted") as caught:
        make()
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda v: type(v).__name__)
@pytest.mark.filterwarnings("error")
def test_what_is_no_number_is_refused_by_its_field(value):
    for item in fields(UGVParams):
        refused(item.name, lambda n=item.name: UGVParams(**{n: value}).validate())
    for name, numbers in NUMBERS.items():
        for number in numbers:
            refused(number, lambda t=name, n=number: Track.named(t, **{n: value}))
    for name in ("start", "end"):
        refused(name, lambda n=name: Track.from_function(jnp.sin, **{n: value}))
    refused("roughness", lambda: rough_waves(jax.random.key(0), value))
    refused("x_front", lambda: pose(UGVParams(), Track.flat(), value, ANGLES))
    refused("leg_angles", lambda: pose(UGVParams(), Track.flat(), X, value))
    refused("friction", lambda: equilibrium(UGVParams(), Track.flat(), X, ANGLES, value))
    for name in ("start", "end"):
        ends = {"start": 0.0, "end": 8.0} | {name: value}
        refused(name, lambda ends=ends: Track.flat().resampled(**ends, pieces=4))
        if value is not None:
            refused(name, lambda ends=ends: Odometer.along(Track.flat(), **ends))
    if value is not None:
        refused("tolerance", lambda: PoseSolver(tolerance=value))
    for x, y in ((value, [0.0, 1.0]), ([0.0, 1.0], value), ([0.0, value], [0.0, 1.0])):
        if value is not True:
            with pytest.raises(ValueError, match=r"^[xy]\b.*accepted"):
                Track.from_points(x, y)


@pytest.mark.parametrize("value", NO_INTEGERS, ids=lambda v: type(v).__name__)
def test_what_is_no_size_or_needs_too_much_memory_is_refused(value):
    flat = Track.flat()
    refused("pieces", lambda: flat.resampled(0.0, 1.0, value))
    refused("waves", lambda: Track.rough(waves=value))
    if value is not None:
        refused("cells", lambda: Odometer.along(flat, cells=value))
        refused("pieces", lambda: Track.rough(pieces=value))
        refused("iterations", lambda: PoseSolver(iterations=value))
    refused("candidates", lambda: PoseSolver(candidates=value))
    if value != 0 or value is False:
        refused("samples", lambda: PoseSolver(samples=value))


def test_ground_too_long_is_refused_before_it_is_made():
    for make in (
        lambda: Track.rough(end=1e12),
        lambda: Odometer.along(Track.from_points([0.0, 1e12], [0.0, 0.0])),
        lambda: Odometer.along(Track.flat(end=1e12)),
        lambda: rough_shape(jax.random.key(0), 1e-4, 0.0, 1e9),
    ):
        with pytest.raises(ValueError, match=r"end - start = 1e\+.*STICKSLIP_MEMORY_LIMIT"):
            make()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Track.named("bumb"), "did you mean bump"),
        (lambda: Track.named("bump", heigth=1.0), "did you mean height"),
        (lambda: Track.rough(wave=3), "did you mean waves"),
        (lambda: Track.rough(10**400), "key = "),
        (lambda: Track.rough("seed"), "key = 'seed'"),
        (lambda: Track.rough(True), "key = True"),
        (lambda: Track.rough(band=3.0), "band = 3.0"),
        (lambda: Track.rough(band=("a", 1.0)), "band = 'a'"),
        (lambda: Track.from_function("sin"), "function = 'sin'"),
        (lambda: Track.from_function(lambda x: 1 // 0), "fails"),
        (lambda: PoseSolver("newtn"), "did you mean newton"),
        (lambda: pose(None, Track.flat(), X, ANGLES), "params = None"),
        (lambda: pose(UGVParams(), "flt", X, ANGLES), "did you mean flat?"),
        (lambda: pose(UGVParams(), Track.flat(), X, ANGLES, solver="scan"), "solver = 'scan'"),
        (lambda: pose(UGVParams(), Track.flat(), np.ones(3), np.ones((4, 2))), "x_front (3,)"),
        (lambda: equilibrium(UGVParams(), Track.flat(), X, np.ones((4, 2)), np.ones(3)), "frict"),
        (lambda: equilibrium(UGVParams(), Track.flat(), X, ANGLES, system="eleven"), "system"),
        (lambda: Odometer.along(3), "track = 3"),
    ],
)  # fmt: skip
def test_names_kinds_and_shapes_that_will_not_do_are_refused(make, message):
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        make()
    assert len(str(caught.value)) < 500


def test_lists_of_numbers_are_taken_where_arrays_are():
    listed = pose(UGVParams(), Track.flat(), [3.0, 4.0], [1.5, 1.5])
    given = pose(UGVParams(), Track.flat(), np.array([3.0, 4.0]), np.array([1.5, 1.5]))
    np.testing.assert_array_equal(listed.rear.x, given.rear.x)
