"""A torque as arithmetic: what it comes to, and that nothing else is ever run."""

import math

import jax
import pytest

from stickslip.dynamics.biped import BipedState
from stickslip.simulate.torque import DEEPEST, FUNCTIONS, LONGEST, Expression

AT = BipedState(phase=2.0, steps=3, crank_rate=1.5, foot_position=-0.2, foot_velocity=0.0, time=0.7)
NAMES = {"t": 0.7, "phase": 2.0, "crank_angle": 2.0 + 3 * math.pi, "crank_rate": 1.5}
NAMES |= {"foot_position": -0.2, "foot_velocity": 0.0, "steps": 3, "pi": math.pi}


@pytest.mark.parametrize(
    "text",
    [
        "0.8 + 0.3 * sin(2 * crank_angle)",
        "-2 ** 2 / 3 - +t % 0.3",
        "1 if t < 0.5 else 2 if crank_rate >= 1.5 else 3",
        "max(0.2, min(1, 8 * (3 - crank_rate))) + foot_position * phase",
        "sqrt(abs(foot_position)) + exp(-t) * cos(pi / 3) + log(steps) + floor(2.7) + tan(tanh(1))",
        "(t > 1) + (t <= 1)",
        "1e-3 * 10 ** 9",
        "+".join(["t"] * 30),
    ],
)
@pytest.mark.parametrize("compiled", [False, True])
def test_it_is_what_python_makes_of_it(text: str, compiled: bool):
    known = {name: getattr(math, name) for name in FUNCTIONS if hasattr(math, name)}
    known |= NAMES | {"abs": abs, "min": min, "max": max}
    expected = eval(text, {"__builtins__": {}}, known)
    law = Expression(text)
    found = (jax.jit(law) if compiled else law)(AT)
    assert float(found) == pytest.approx(float(expected), rel=1e-5)


def test_every_function_takes_as_many_values_as_it_says():
    for name, count in FUNCTIONS.items():
        assert math.isfinite(Expression(f"{name}({', '.join(['0.5'] * count)})")(AT))
        with pytest.raises(ValueError, match=f"{name} takes {count} value"):
            Expression(f"{name}({', '.join(['0.5'] * (count + 1))})")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("crank_rat", r"'crank_rat' is unknown \(did you mean crank_rate\?\)"),
        ("__import__('os').system('true')", "is not accepted"),
        ("open('f', 'w')", "'open' is unknown"),
        ("t.real", "is not accepted"),
        ("(lambda: 1)()", "is not accepted"),
        ("[t for t in (1, 2)][0]", "is not accepted"),
        ("'a' * 9", "is not accepted"),
        ("1j", "is not accepted"),
        ("9" * 400, "is not accepted"),
        ("sin(t, where=1)", "sin takes 1 value"),
        ("", "accepted: arithmetic"),
        ("t\0", "accepted: arithmetic"),
        ("1 // 2", "is not accepted"),
        ("(" * 300 + "1" + ")" * 300, "accepted: arithmetic"),
        ("-" * (DEEPEST + 2) + "1", "nested deeper"),
        ("1+" * LONGEST + "1", "characters"),
    ],
)
def test_what_is_no_such_arithmetic_is_refused_with_what_is(text: str, said: str):
    with pytest.raises(ValueError, match=said):
        Expression(text)
