"""MJX on the same MJCF at a few batches, each in a process of its own under a time limit."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.cases import DURATION, Case, Measured, Timing, ends, error_of
from benchmarks.peers.mechanism import Mechanism, mechanism
from benchmarks.peers.mjcf import Settings
from stickslip.dynamics.biped import BipedParams

NAME = "MJX"
LIMIT = 100.0
"""For one batch, compilation included [s]."""
ROOT = Path(__file__).parents[2]


def measure(case: Case, quick: bool) -> Iterator[Measured]:
    """Batches up to 256 in float32; pinned to one core, at most LIMIT seconds each."""
    machine = mechanism(BipedParams.from_bars(dtype=np.float64))
    ratio = 1.0 if case.friction is None else 2.0
    for batch in (1, 64) if quick else (1, 64, 256):
        timestep = DURATION / 200
        settings = Settings(timestep, "RK4", (ratio * timestep, 1.0), iterations=4)
        yield _measure(case, machine, settings, batch, LIMIT)


def _measure(
    case: Case, machine: Mechanism, settings: Settings, batch: int, limit: float
) -> Measured:
    asked = {
        "case": asdict(case),
        "settings": asdict(settings),
        "machine": _plain(machine),
        "batch": batch,
        "steps": round(DURATION / settings.timestep),
        "wide": False,
        "repeats": 2,
        "budget": 5.0,
    }
    found, why = _in_process(asked, limit)
    common: dict[str, Any] = {"program": NAME, "case": case.name, "batch": batch, "threads": 1}
    common["setting"] = (
        f"float32, {settings.integrator}, {1e3 * settings.timestep:.3g} ms, "
        f"solref {settings.solref[0] / settings.timestep:.2g} steps"
    )
    if found is None:
        nothing: dict[str, Any] = {"error": float("inf"), "build": 0.0}
        nothing |= dict.fromkeys(("rate", "slowest", "core_rate"), 0.0)
        return Measured(**common, **nothing, note=why)
    rates = Timing(found["seconds"], found["core_seconds"]).rates(batch * DURATION)
    error = error_of(found["angles"], ends(case, batch))
    return Measured(**common, error=error, **rates, build=found["build"])


def _in_process(asked: dict[str, Any], limit: float) -> tuple[dict[str, Any] | None, str]:
    """What the worker found, or None and why not."""
    command = [sys.executable, "-m", "benchmarks.peers.mjx_worker", json.dumps(asked)]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            check=False,
            timeout=limit,
            cwd=ROOT,
        )
    except subprocess.TimeoutExpired:
        return None, f"not done after {limit:.0f} s"
    if done.returncode != 0:
        said = [line for line in done.stderr.splitlines() if "Error" in line]
        return None, (said or ["no message"])[-1]
    return json.loads(done.stdout.strip().splitlines()[-1]), ""


def _plain(machine: Mechanism) -> dict[str, Any]:
    """The mechanism as what JSON can hold."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: plain(item) for name, item in value.items()}
        return value.tolist() if isinstance(value, np.ndarray) else value

    return plain(vars(machine))
