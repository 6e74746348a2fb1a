"""A C loop written by hand over our table: what the processor could do, as a yardstick.

Classical Runge-Kutta steps in one mode, float64, no events, no status, no forces, one core, SIMD by
the compiler. It shares the table and nothing else: the numbers show that it computes the same walk.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers.cases import DURATION, SPREAD, Measured, timed
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedModel,
    BipedParams,
    BipedState,
    Table,
    prepare,
    simulate,
)

NAME = "C loop"
FLAGS = (
    *("-O3", "-march=native", "-mprefer-vector-width=512", "-std=c11"),
    # -ffast-math by its parts: as a whole it would switch off subnormal numbers in this process
    *("-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-fassociative-math"),
    *("-freciprocal-math", "-ffinite-math-only", "-ffp-contract=fast"),
)
BLOCK = 64
"""Members that are stepped together, so that their state stays in the nearest cache."""
FRICTION = 0.4
SOURCE = Path(__file__).with_name("loop.c")

# where a walk of one mode starts: at rest, or sliding backwards fast enough to slide to the end
START = {"stick": (SUPPORT_START, 0.0, 0.0), "slip": (3.7, 9.0, -1.0)}
LENGTH = {"stick": DURATION, "slip": 0.05}


def table_model(table: Table) -> BipedModel:
    """The default robot with tables in float64."""
    make = jax.jit(partial(prepare, fidelity=table))
    return make(BipedParams.from_bars(dtype=np.float64))


def source(model: BipedModel, slides: bool) -> str:
    """The C program: numbers of this model, in hexadecimal so that no bit is lost, then loop.c.

    Coefficient k of function j (M, P, Y) is TABLE[j][k][piece], for the position in [-1, 1] within
    a piece, as in `TableInertia`.
    """
    coefficients = np.asarray(model.inertia.momenta, float)  # type: ignore[union-attr]
    pieces, functions, powers = coefficients.shape
    rows = [
        "    {" + ", ".join(float(value).hex() for value in coefficients[:, j, k]) + "},"
        for j in range(functions)
        for k in range(powers)
    ]
    body = [
        "  {",
        *(
            line
            for j in range(functions)
            for line in (*rows[j * powers : (j + 1) * powers], "  },")
        ),
    ]
    for j in range(1, functions):
        body.insert(1 + j * (powers + 1) + (j - 1), "  {")
    constants = {
        "START": SUPPORT_START,
        "SCALE": pieces / (SUPPORT_END - SUPPORT_START),
        "MASS": float(model.total_mass),
        "GRAVITY": float(model.gravity),
        "FRICTION": FRICTION,
    }
    lines = [f"#define PIECES {pieces}", f"#define POWERS {powers}", f"#define BLOCK {BLOCK}"]
    lines += [f"#define SLIDES {int(slides)}"]
    lines += [f"static const double {name} = {value.hex()};" for name, value in constants.items()]
    lines += ["static const double TABLE[3][POWERS][PIECES] = {", *body, "};"]
    return "\n".join(lines) + "\n\n" + SOURCE.read_text(encoding="utf-8")


def compiler() -> str | None:
    """A C compiler on the path, if any."""
    return next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)


class Loop:
    """The compiled loop. RuntimeError with the compiler's words if it does not compile."""

    def __init__(self, model: BipedModel, slides: bool, compile_with: str):
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            code, library = Path(folder) / "loop.c", Path(folder) / "loop.so"
            code.write_text(source(model, slides), encoding="utf-8")
            command = [compile_with, *FLAGS, "-shared", "-fPIC", "-o", str(library), str(code)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(done.stderr)
            loaded = ctypes.CDLL(str(library))
        column = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
        loaded.walk.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_double, *[column] * 5]
        loaded.walk.restype = None
        self.walk, self.build = loaded.walk, time.perf_counter() - begun

    def run(self, torque, start, steps: int, dt: float) -> list[np.ndarray]:
        """Crank angle, rate, slide and velocity at the end, for torques [a multiple of BLOCK]."""
        if len(torque) % BLOCK:
            raise ValueError(f"batch = {len(torque)}; accepted: a multiple of {BLOCK}")
        theta, rate, velocity = (np.full(len(torque), value) for value in start)
        slide = np.zeros(len(torque))
        self.walk(
            len(torque), steps, dt, np.ascontiguousarray(torque), theta, rate, slide, velocity
        )
        return [theta, rate, slide, velocity]


def measure(quick: bool, batch: int = 4096) -> Iterator[Measured]:
    """Steps of 10 ms sticking and of 1 ms sliding; error against our own float64 steps."""
    found = compiler()
    if found is None:
        return
    for table in (Table(32, 7), Table(128, 3)):
        model = table_model(table)
        for name, steps in (("stick", 79), ("slip", 50)):
            loop = Loop(model, name == "slip", found)
            torque, dt = np.linspace(*SPREAD, batch), LENGTH[name] / steps
            run = partial(loop.run, torque, START[name], steps, dt)
            angle = run()[0][0]
            taken = timed(run, 10 if quick else 40, 1.0)
            rates = taken.rates(batch * LENGTH[name])
            yield Measured(
                program=NAME,
                case=f"{name}, one mode",
                setting=f"float64, table {table.pieces}x{table.degree}, {1e3 * dt:.3g} ms",
                batch=batch,
                threads=1,
                error=abs(float(angle) - _own(model, name, steps)),
                **rates,
                build=loop.build,
                note=f"{rates['core_rate'] / dt:.3g} steps a core-second; error from our own steps",
            )


def _own(model: BipedModel, name: str, steps: int) -> float:
    """Our crank angle for the same steps and the first torque."""
    scene = Scene.grip(outputs="state")
    if name == "slip":
        scene = Scene.uniform(FRICTION, FRICTION, outputs="state")
    theta, rate, velocity = (jnp.asarray(value, np.float64) for value in START[name])
    state = BipedState(phase=theta, crank_rate=rate, foot_velocity=velocity)
    end = simulate(model, scene, state, SPREAD[0], LENGTH[name], LENGTH[name] / steps)
    return float(end.final.crank_angle)
