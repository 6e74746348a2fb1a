"""What smoothing friction costs in truth, and what it asks of a step.

    python -m benchmarks.smoothed [--out FILE]

Scene.smoothed beside dry friction, in float64: the creep where dry friction holds, the error over a
step as slip_speed falls, derivatives beside those of hard switching, and the largest stable steps.
docs/gradients.md discusses the numbers.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks import gradients
from benchmarks.gradients import default_model
from benchmarks.report import markdown, options, provenance, write_json
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    RK4,
    BipedState,
    forward_dynamics,
    step,
)

SLIP_SPEEDS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
"""[m/s]"""

WALKS = {
    # torque, phase, crank rate, coefficient (static and kinetic), duration
    "dry friction holds": (1.0, np.pi / 2, 0.0, 0.5, 0.5),
    "slides off, stops": (1.2, np.pi / 2, 0.0, 0.12, 0.3),
    "breaks loose, stops": (0.0, 2.0, 3.0, 0.05, 0.7),
}

INPUTS = ("torque", "crank rate", "mu")
OUTPUTS = ("crank angle", "slide")

STABLE = {"euler": 2.0, "semi_implicit": 2.0, "rk4": 2.785, "rk4_split": 2.785}
"""Bound on decay rate times step of each scheme: -1 and 0 are the ends of its real interval."""


def decay_factor(angle):
    """How many times faster creep decays than mu g / slip_speed says: M m / (M m - P^2).

    The crank gives way when the foot is pushed, so the foot weighs less than the robot.
    """
    inertia, mass = default_model().inertia.at(angle), default_model().total_mass
    return inertia.M * mass / (inertia.M * mass - inertia.P**2)


def fine_step(mu: float, slip_speed: float) -> float:
    """A step of 1.5 decay times of creep at the lightest phase, RK4's bound being 2.785 [s]."""
    model = default_model()
    angles = jnp.linspace(np.pi / 2, 3 * np.pi / 2, 401)
    fastest = jnp.max(jax.vmap(decay_factor)(angles))
    return min(1e-3, 1.5 * slip_speed / (mu * float(model.gravity) * float(fastest)))


@jax.jit
def roll(numbers, phase, slip_speed, size, count):
    """Crank angle and slide after `count` steps of `size` [s] with smoothed friction."""
    torque, rate, mu = numbers
    scene = Scene.smoothed(mu, slip_speed, outputs="state")
    zero = jnp.zeros_like(phase)
    state = BipedState(phase, jnp.zeros((), jnp.int32), rate, zero, zero, zero)

    def body(_, now):
        return step(default_model(), scene, now, torque, size, integrator=RK4())[0]

    end = jax.lax.fori_loop(0, count, body, state)
    return jnp.stack([end.crank_angle, end.foot_position]), end


def dry(
    torque: float, phase: float, rate: float, mu: float, duration: float, spec=gradients.TIGHT
) -> tuple[np.ndarray, np.ndarray]:
    """OUTPUTS with dry friction, mu static = mu kinetic, and their derivatives by INPUTS."""
    inputs = jnp.asarray([torque, rate, mu, mu, gradients.NOWHERE])
    start = (jnp.asarray(phase), jnp.zeros(()), jnp.asarray(duration))
    weights = jnp.ones(len(gradients.OUTPUTS) + gradients.SWITCHES)
    found = gradients.derivatives(spec, weights, inputs, *start)
    ends = [gradients.OUTPUTS.index(name) for name in OUTPUTS]
    slopes = np.asarray(found.forward)[ends]
    by_mu = slopes[:, 2:4].sum(axis=1)
    return np.asarray(found.values)[ends], np.column_stack([slopes[:, :2], by_mu])


@jax.jit
def slopes(numbers, phase, slip_speed, size, count):
    """Derivatives of `roll` by INPUTS, one column each."""

    def push(along):
        end = lambda n: roll(n, phase, slip_speed, size, count)[0]  # noqa: E731
        return jax.jvp(end, (numbers,), (along,))[1]

    return jax.vmap(push, out_axes=1)(jnp.eye(len(INPUTS)))


def differences(function, numbers, h: float) -> np.ndarray:
    """Central differences by INPUTS, one column each."""
    shifts = [h * np.eye(len(INPUTS))[i] for i in range(len(INPUTS))]
    pairs = [(function(numbers + s), function(numbers - s)) for s in shifts]
    return np.stack([(np.asarray(a) - np.asarray(b)) / (2 * h) for a, b in pairs], axis=1)


def errors() -> list[dict[str, Any]]:
    """End of each walk and its derivatives, smoothed against dry, and against differences."""
    rows = []
    for name, start in WALKS.items():
        torque, phase, rate, mu, duration = start
        numbers = jnp.asarray([torque, rate, mu])
        want, by = dry(*start)
        for slip_speed in SLIP_SPEEDS:
            count = math.ceil(duration / fine_step(mu, slip_speed))
            how = jnp.asarray(phase), jnp.asarray(slip_speed), jnp.asarray(duration / count), count
            got = np.asarray(roll(numbers, *how)[0])
            derived = np.asarray(slopes(numbers, *how))
            at = lambda n: roll(n, *how)[0]  # noqa: B023, E731
            numeric = differences(at, numbers, 1e-3 * slip_speed)
            scale = np.max(np.abs(derived), axis=1, keepdims=True)
            off, size = (np.max(np.abs(table), axis=1) for table in (derived - by, by))
            row = {
                "walk": name,
                "slip speed [m/s]": f"{slip_speed:.0e}",
                "crank angle [rad]": f"{abs(got[0] - want[0]):.1e}",
                "slide [m]": f"{abs(got[1] - want[1]):.1e}",
                "derivatives of angle": f"{off[0] / size[0]:.1e}",
                "of slide": f"{off[1] / size[1]:.1e}" if size[1] > 0 else f"({off[1]:.1e})",
                "by differences": f"{np.max(np.abs(derived - numeric) / scale):.1e}",
                "steps": count,
            }
            rows.append(row)
            print("  " + ", ".join(f"{name} {value}" for name, value in row.items()), flush=True)
    return rows


def creep() -> list[dict[str, Any]]:
    """Foot velocity where dry friction holds, beside slip_speed artanh(use)."""
    rows = []
    torque, phase, rate, mu, _ = WALKS["dry friction holds"]
    for slip_speed in SLIP_SPEEDS:
        count = math.ceil(0.3 / fine_step(mu, slip_speed))
        numbers = jnp.asarray([torque, rate, mu])
        how = jnp.asarray(phase), jnp.asarray(slip_speed), jnp.asarray(0.3 / count), count
        _, end = roll(numbers, *how)
        at = (end.crank_angle, end.crank_rate, jnp.zeros_like(end.crank_rate))
        still = forward_dynamics(default_model(), *at, numbers[0], numbers[2], numbers[2])
        use = float(jnp.abs(still.friction_force) / (mu * still.normal_force))
        want = slip_speed * math.atanh(use)
        got = abs(float(end.foot_velocity))
        rows.append(
            {
                "slip speed [m/s]": f"{slip_speed:.0e}",
                "use": f"{use:.4f}",
                "creep [m/s]": f"{got:.4e}",
                "slip speed artanh(use)": f"{want:.4e}",
                "apart": f"{abs(got / want - 1):.1e}",
            }
        )
    return rows


@partial(jax.jit, static_argnums=0)
def creep_left(integrator: str, phase, slip_speed, mu, size):
    """Creep after 60 steps, in units of what it began with, on a robot held by its motor."""
    model = default_model()
    torque = model.gravity * model.inertia.at(phase).Y
    scene = Scene.smoothed(mu, slip_speed, outputs="state")
    zero = jnp.zeros_like(phase)
    begin = 1e-3 * slip_speed
    state = BipedState(phase, jnp.zeros((), jnp.int32), zero, zero, begin, zero)

    def body(_, now):
        return step(model, scene, now, torque, size, integrator=integrator)[0]

    return jnp.abs(jax.lax.fori_loop(0, 60, body, state).foot_velocity) / begin


def stable_steps(mu: float = 0.1, slip_speed: float = 1e-4) -> list[dict[str, Any]]:
    """Largest step that lets creep decay, by bisection, in units of slip_speed / (mu g)."""
    model, rows = default_model(), []
    unit = slip_speed / (mu * float(model.gravity))
    for integrator, bound in STABLE.items():
        for phase in (0.55, 0.665, 0.8, 1.0):
            angle = jnp.asarray(phase * np.pi)
            factor = float(decay_factor(angle))
            low, high = 0.05, 5.0
            for _ in range(16):
                size = (low + high) / 2
                numbers = jnp.asarray([slip_speed, mu, size * unit])
                grows = float(creep_left(integrator, angle, *numbers)) > 1
                low, high = (low, size) if grows else (size, high)
            rows.append(
                {
                    "integrator": integrator,
                    "phase / pi": phase,
                    "largest step": f"{low:.3f}",
                    "M m / (M m - P^2)": f"{factor:.3f}",
                    "product": f"{low * factor:.3f}",
                    "bound": bound,
                }
            )
    return rows


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the tables, write the JSON."""
    given = options("smoothed", __doc__).parse_args(arguments)
    tables = {}
    with jax.enable_x64(True):
        for title, measure in (
            ("creep", creep),
            ("largest stable steps, in slip_speed / (mu g)", stable_steps),
            ("smoothed beside dry", errors),
        ):
            tables[title] = measure()
            print(f"\n{title}\n\n{markdown(tables[title])}\n", flush=True)
    write_json({**provenance(), **tables}, given.out)
    print(f"Written to {given.out}")


if __name__ == "__main__":
    main()
