"""A problem made of one function in JAX: its numbers, its slopes, and what is no number."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.optim import FunctionProblem

LOW, HIGH = np.array([-2.0, -2.0, 0.5]), np.array([2.0, 2.0, 0.5])


def valley(data, x, draw):
    """Rosenbrock's with a disc, and a second goal; noise of what `draw` says."""
    noise = jax.random.normal(jax.random.key(draw), (), x.dtype) * data["noise"]
    first = data["scale"] * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2 + x[2] + noise
    return jnp.stack([first, jnp.sum(x)]), (2 - x[0] ** 2 - x[1] ** 2)[None]


def broken(data, x, draw):
    return (jnp.log(x[0]) + 0 * x[1])[None], jnp.sqrt(x[1])[None]


def problem(**changes):
    data = {"scale": 10.0, "noise": 0.0}
    return FunctionProblem(**{"function": valley, "data": data, "low": LOW, "high": HIGH} | changes)


def test_values_slopes_and_batches_are_the_function_s():
    one, x = problem(), np.array([0.3, -0.4, 0.5])
    at = one.evaluate(x)
    assert at.value == pytest.approx(10 * (0.4 + 0.09) ** 2 + 0.49 + 0.5, rel=1e-14)
    assert at.margins == pytest.approx([1.75])
    assert one.sizes == (2, 1)
    h = 1e-6 * np.eye(3)
    slopes = [(one.objective(x + d) - one.objective(x - d)) / 2e-6 for d in h]
    for forward in (False, True):
        assert problem(forward=forward).gradient(x) == pytest.approx(slopes, rel=1e-7)
    assert one.jacobian(x) == pytest.approx(np.array([[-0.6, 0.8, 0]]))
    X = np.array([x, x + 0.1, x - 0.2])
    assert one.objectives(X) == pytest.approx([one.objective(row) for row in X], rel=1e-14)
    assert one.evaluate_all(X)[1][:, 0] == pytest.approx([one.constraints(row)[0] for row in X])
    assert problem(goal=1).objectives(X) == pytest.approx(X.sum(axis=1))
    assert one.free.n == 2
    assert one.free.expand(one.free.reduce(X)) == pytest.approx(X * [1, 1, 0] + [0, 0, 0.5])
    assert one.free.constraints([0.3, -0.4]) == pytest.approx(one.constraints(x))
    assert one.free.jacobian([0.3, -0.4]) == pytest.approx(one.jacobian(x)[:, :2])
    assert one.free.gradient([0.3, -0.4]) == pytest.approx(slopes[:2], rel=1e-7)
    assert one.free.evaluate_all(X[:, :2])[1].shape == (3, 1)
    assert one.objectives(np.zeros((0, 3))).shape == (0,)


def test_what_is_no_number_is_infinite_missed_and_flat():
    one = FunctionProblem(broken, {}, np.full(2, -1.0), np.ones(2))
    at = one.evaluate([-0.5, -0.5])
    assert (at.value, at.margins.tolist(), at.feasible) == (np.inf, [-1.0], False)
    assert np.all(np.isfinite(one.gradient([-0.5, -0.5])))
    assert np.all(np.isfinite(one.jacobian([0.0, 0.0])))
    assert one.objectives([[-0.5, 0.0], [1.0, 0.0]]).tolist() == [np.inf, 0.0]


def test_a_limit_met_by_any_amount_is_met_and_others_that_are_not_finite_are_missed():
    def limits(data, x, draw):
        return x[:1], x[0] / jnp.asarray([0.0, 1.0]) + jnp.asarray([0.0, 1.0])

    one = FunctionProblem(limits, None, np.full(1, -0.5), np.ones(1))
    assert one.evaluate([0.5]).margins.tolist() == [1.0, 1.5]
    assert one.evaluate([0.5]).feasible
    assert one.evaluate([-0.5]).margins.tolist() == [-1.0, 0.5]
    assert one.evaluate([0.0]).margins.tolist() == [-1.0, 1.0]  # 0 / 0
    assert one.sample([[0.5], [-0.5]])[1].tolist() == [0.0, 1.0]


def test_integers_and_no_margins_are_rows_of_floats():
    def counted(data, x, draw):
        return [jnp.sum(x > 0.25).astype(int)], []

    one = FunctionProblem(counted, None, np.zeros(2), np.ones(2))
    assert one.sizes == (1, 0)
    assert one.objectives([[0.2, 0.3], [0.0, 0.0]]).tolist() == [1.0, 0.0]
    assert one.gradient([0.2, 0.3]).tolist() == [0.0, 0.0]


UNFIT = {
    "None": (lambda x: None, "returned None"),
    "a value alone": (lambda x: x[0], "function returned"),
    "three": (lambda x: (x, x, x), "function returned"),
    "a table": (lambda x: (x[None], x), r"returned values \(1, 2\), margins \(2,\)"),
    "no value": (lambda x: ([], x), r"returned values \(0,\), margins \(2,\)"),
    "words": (lambda x: ("low", x), "function returned"),
    "a branch": (lambda x: (x if x[0] > 0 else -x, x), "asks what a number is while it is traced"),
    "NumPy": (lambda x: (np.sin(x), x), "asks what a number is while it is traced"),
}


@pytest.mark.parametrize("name", UNFIT)
def test_what_a_function_may_not_return_is_said_when_the_problem_is_made(name):
    returned, words = UNFIT[name]

    def function(data, x, draw):
        return returned(x)

    with pytest.raises(ValueError, match=words) as refusal:
        FunctionProblem(function, None, np.zeros(2), np.ones(2))
    assert "accepted: function(data, x, draw) of JAX operations" in str(refusal.value)
    assert len(str(refusal.value)) < 500


def test_a_draw_decides_and_nothing_else():
    noisy = problem(data={"scale": 10.0, "noise": 1.0})
    x = np.array([0.1, 0.2, 0.5])
    drawn = [noisy.drawn(i).objective(x) for i in range(3)]
    assert len(set(drawn)) == 3
    assert [noisy.drawn(i).free.objective(x[:2]) for i in range(3)] == drawn
    batch = noisy.at_all(np.tile(x, (3, 1)), np.arange(3))[0][:, 0]
    assert batch == pytest.approx(drawn, rel=1e-14)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"low": LOW[:2]}, r"accepted: \[n\], low <= high"),
        ({"low": HIGH + 1}, "low <= high"),
        ({"high": np.array([1, np.nan, 1])}, "high"),
        ({"goal": 2}, "goal = 2; accepted: 0 to 1"),
        ({"goal": 0.5}, "goal = 0.5; accepted: 0 to 1"),
        ({"draw": -1}, "draw = -1"),
        ({"function": 3}, r"function = 3; accepted: function\(data, x, draw\)"),
        ({"function": lambda data, x: x}, r"takes 2 .*accepted: function\(data, x, draw\)"),
    ],
)
def test_fields_that_will_not_do(changes, words):
    with pytest.raises(ValueError, match=words):
        problem(**changes)
    with pytest.raises(ValueError, match=r"accepted: \(3,\)"):
        problem().evaluate([1.0])
