"""A sweep on several devices finds, to the bit, what one device finds."""

import json
import os
import subprocess
import sys
from pathlib import Path

from stickslip.agents import read_sweep
from tests.agents.sweeps.masses import swept

SCRIPT = """
import json, sys
import jax
from stickslip.agents.machine import register
from tests.agents.mass import MassMachine
from tests.agents.sweeps.masses import swept

register(MassMachine())
used, device = set(), jax.default_device
def noted(one):
    used.add(str(one))
    return device(one)
jax.default_device = noted
swept(sys.argv[1])
print(json.dumps([jax.device_count(), len(used)]))
"""


def test_devices_share_a_sweep_and_change_no_bit(tmp_path):
    count = 2
    swept(tmp_path / "one")
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count={count}"
    paths = os.pathsep.join([str(Path(__file__).resolve().parents[3]), *filter(None, sys.path)])
    told = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "several")],
        env=os.environ | {"PYTHONPATH": paths, "JAX_PLATFORMS": "cpu", "XLA_FLAGS": flags},
        check=True,
        capture_output=True,
        text=True,
    )
    assert json.loads(told.stdout) == [count, count]
    one, several = (read_sweep(tmp_path / name) for name in ("one", "several"))
    assert several.combine_chunks().equals(one.combine_chunks())
