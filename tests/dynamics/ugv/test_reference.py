"""Every value of the UGV's reference file, to 1e-9 relative, in float64; near it in float32."""

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from tests.dynamics.ugv.helpers import balanced

FILE = Path(__file__).parents[2] / "reference" / "ugv_default.json"
ROWS = json.loads(FILE.read_text(encoding="utf-8"))["rows"]
TRACKS = {"bump": Track.bump, "slope": Track.incline}


def measured(dtype, **options):
    """(name, ours, theirs) of every number in the file."""
    for name, build in TRACKS.items():
        rows = [row for row in ROWS if row["track"] == name]
        x = jnp.asarray([row["x_front"] for row in rows], dtype)
        angles = jnp.asarray([[row["phi_rear"], row["phi_front"]] for row in rows], dtype)
        ours = balanced(UGVParams(), build().astype(dtype), x, angles, **options)
        pose = ours.pose
        values = {
            "x_rear": pose.rear.x,
            "pitch": pose.pitch,
            "body": pose.body,
            "rear_wheel": pose.rear.centre,
            "potential_energy": pose.potential_energy(UGVParams()),
            **{key: getattr(ours, key) for key in ("F_rear", "N_rear", "F_front", "N_front")},
            "torque": ours.torque,
        }
        for key, value in values.items():
            yield key, np.asarray(value), np.asarray([row[key] for row in rows])


@pytest.mark.parametrize(
    "solver", [PoseSolver(), PoseSolver(iterations=6, samples=0)], ids=["adaptive", "6"]
)
def test_the_reference_is_met(float64, solver):
    for name, ours, theirs in measured(float64, solver=solver):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, err_msg=name)


def test_single_precision_keeps_six_digits_of_the_vehicle():
    dtype = jnp.float32
    scale = {"F": 4400, "N": 4400, "t": 4400 * 0.28, "p": 4400, "x": 5, "b": 5, "r": 5}
    for name, ours, theirs in measured(dtype):
        size = 1.0 if name == "pitch" else scale[name[0]]
        assert ours.dtype == dtype
        np.testing.assert_allclose(ours, theirs, atol=3e-6 * size, rtol=0, err_msg=name)
