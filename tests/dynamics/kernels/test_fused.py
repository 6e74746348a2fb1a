"""A function as one kernel: the same numbers, whatever the batch, and really one kernel."""

import secrets
from collections import Counter
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.kernels.grouping import SWITCH, grouped
from tests.trees import assert_same


def settle(power, start, pull, key):
    """Loops, random numbers, integers, and results that have much in common."""

    def body(state):
        x, count = state
        common = jnp.sin(x) * pull + x**power
        return 0.5 * (x + common / (1 + jnp.abs(common))), count + 1

    x, count = jax.lax.while_loop(lambda s: (jnp.abs(s[0]) > 0.1) & (s[1] < 9), body, (start, 0))
    noise = jax.random.uniform(key)
    shared = jnp.exp(x) * noise
    return {"x": x, "count": count, "sum": shared + x, "product": shared * x, "far": shared > 1}


def arguments(size: int):
    rng = np.random.default_rng(size)
    starts = jnp.asarray(rng.uniform(0.2, 3.0, size), jnp.float32)
    return starts, jnp.float32(0.7), jax.random.split(jax.random.key(size), size)


def batch_of(function, size: int):
    return jax.jit(jax.vmap(partial(function, 2), (0, None, 0)))(*arguments(size))


@pytest.mark.parametrize("size", [1, 65, 1024])
def test_a_batch_of_any_size_gives_what_its_members_give_alone(size):
    many = batch_of(fused(settle, fixed=1), size)
    plain = batch_of(settle, size)
    starts, pull, keys = arguments(size)
    alone = jax.jit(partial(fused(settle, fixed=1), 2))(starts[-1], pull, keys[-1])
    for name in many:
        assert many[name].shape == (size,)
        assert many[name].dtype == plain[name].dtype
        np.testing.assert_allclose(many[name], plain[name], rtol=3e-6, err_msg=name)
        np.testing.assert_allclose(alone[name], many[name][-1], rtol=3e-6, err_msg=name)


def test_nested_batches_and_shared_arguments():
    function = fused(lambda x, y, z: jnp.sin(x) * y + z)
    x, y, z = jnp.arange(6.0), jnp.arange(100.0), jnp.arange(600.0).reshape(6, 100)
    nested = jax.vmap(jax.vmap(function, (None, 0, 0)), (0, None, 0))(x, y, z)
    np.testing.assert_allclose(nested, np.sin(x)[:, None] * np.asarray(y) + z, rtol=1e-6)


def test_derivatives_are_those_of_the_function():
    kernel = fused(lambda x, y: jnp.sin(x) * jnp.exp(y))
    x, y = jnp.float32(0.3), jnp.float32(-0.2)
    assert jax.grad(kernel)(x, y) == pytest.approx(float(jnp.cos(x) * jnp.exp(y)), rel=1e-6)
    slopes = jax.vmap(jax.grad(kernel), (0, None))(jnp.linspace(0, 1, 70), y)
    np.testing.assert_allclose(slopes, np.cos(np.linspace(0, 1, 70)) * np.exp(-0.2), rtol=1e-5)
    second = jax.jvp(jax.grad(kernel), (x, y), (jnp.ones_like(x), jnp.zeros_like(y)))[1]
    assert second == pytest.approx(float(-jnp.sin(x) * jnp.exp(y)), rel=1e-5)


def machine_code(program, given, folder: Path) -> list[str]:
    """Names of the functions that XLA compiles a program to, in as many pieces as usual."""
    options = {"xla_cpu_parallel_codegen_split_count": 32, "xla_disable_hlo_passes": ""}
    program.lower(*given).compile(compiler_options=options | {"xla_dump_to": str(folder)})
    return [path.name.split("obj-file.")[1] for path in folder.glob("*obj-file*.o")]


@pytest.mark.parametrize("size", [None, 3])
def test_xla_compiles_the_kernel_as_one(size, tmp_path):
    """If this fails with a new JAX, its XLA no longer reads AS_ONE_KERNEL: steps are slow then."""
    own = secrets.randbits(20) / 2**20  # or an earlier run may have kept the program

    def program(function):
        function = partial(function, 2)
        if size is not None:
            function = jax.vmap(function, (0, None, 0))
        return jax.jit(lambda start, *others: function(start + own, *others))

    given = arguments(size or 1)
    if size is None:
        given = given[0][0], given[1], given[2][0]
    kernel = machine_code(program(fused(settle, fixed=1)), given, tmp_path / "kernel")
    assert sum("and_first" in name for name in kernel) == 1
    plain = machine_code(program(settle), given, tmp_path / "plain")
    assert len(kernel) <= 2 < 6 < len(plain)


@pytest.mark.parametrize(
    "unread", [lambda x, y: jnp.sin(x), lambda x, y: jnp.sin(x) + jnp.where(jnp.array(True), x, y)]
)
@pytest.mark.parametrize("size", [None, 5000])
@pytest.mark.parametrize("constant", [False, True])
def test_arguments_that_nothing_reads_do_no_harm(unread, size, constant):
    """XLA's compiler aborts the process over them if it is left alone with them."""
    shape = () if size is None else (size,)
    x, y = jnp.ones(shape), jnp.full(shape, 0.5)
    function = fused(unread) if size is None else jax.vmap(fused(unread))

    def looped(x, y):
        return jax.lax.scan(lambda x, _: (function(x, y), None), x, None, length=2)[0]

    closed, whole = jax.jit(lambda x: looped(x, y)), jax.jit(looped, keep_unused=True)
    program = closed if constant else partial(whole, y=y)
    np.testing.assert_allclose(program(x).shape, shape)


def separate(x, y, key):
    """Results that need different arguments."""
    return {"x": jnp.sin(x), "draw": jnp.exp(y) * jax.random.uniform(key), "y": 2 * y}


@pytest.mark.parametrize("size", [None, 300])
@pytest.mark.parametrize("read", [("x",), ("x", "draw"), ("y",)])
def test_what_a_program_does_not_read_is_not_in_its_kernel(read, size):
    """In a loop, too. Where only results of shared arguments are read, all stays."""
    over = (lambda function: function) if size is None else partial(jax.vmap, in_axes=(0, None, 0))
    shape = () if size is None else (size,)
    x, y, keys = jnp.full(shape, 0.5), jnp.float32(0.7), jax.random.split(jax.random.key(0), shape)

    def twice(function, x, y, keys):
        def step(x, _):
            found = over(function)(x, y, keys)
            return found["x"] if "x" in read else x, {name: found[name] for name in read}

        return jax.lax.scan(step, x, None, length=2)[1]

    program = jax.jit(partial(twice, fused(separate)))
    text = program.lower(x, y, keys).as_text()
    whole = read == ("y",) and size is not None
    assert ("exponential" in text) == (whole or "draw" in read)
    assert ("sine" in text) == (whole or "x" in read)
    found, plain = program(x, y, keys), jax.jit(partial(twice, separate))(x, y, keys)
    for name in read:
        assert found[name].shape == (2, *shape)
        np.testing.assert_allclose(found[name], plain[name], rtol=1e-6, err_msg=name)


@pytest.mark.parametrize(
    "outside",
    [
        lambda x: jnp.sort(x),
        lambda x: jnp.zeros(4).at[x.astype(int)].add(1.0),
        lambda x: jnp.linalg.solve(jnp.eye(4) * 2, x),
        lambda x: jnp.outer(x, x) @ jnp.outer(x, x),
    ],
)
def test_what_no_kernel_can_hold_is_computed_without_one(outside):
    x = jnp.asarray(np.random.default_rng(0).uniform(0, 3, (80, 4)), jnp.float32)
    found = jax.jit(jax.vmap(fused(outside)))(x)
    np.testing.assert_allclose(found, jax.vmap(outside)(x), rtol=1e-6)


@pytest.mark.parametrize(("count", "numbers"), [(1, 300_000), (3, 60_000)])
def test_tables_that_xla_would_read_by_several_threads_are_read_by_one(count, numbers):
    tables = [jnp.sin(k * jnp.arange(float(numbers))) for k in range(1, count + 1)]
    look_up = lambda x, tables: jnp.cos(x) * sum(table[jnp.int32(x)] for table in tables)  # noqa: E731
    x = jnp.linspace(0, 5e4, 1000)
    found = jax.jit(jax.vmap(fused(look_up), (0, None)))(x, tables)
    np.testing.assert_allclose(found, jax.vmap(look_up, (0, None))(x, tables), atol=1e-5)


def test_other_platforms_are_left_to_vmap():
    program = jax.jit(jax.vmap(partial(fused(settle, fixed=1), 2), (0, None, 0)))
    lowered = program.trace(*arguments(9))
    assert "xla_cpu_small_call" in lowered.lower(lowering_platforms=("cpu",)).as_text()
    assert "xla_cpu_small_call" not in lowered.lower(lowering_platforms=("cuda",)).as_text()


def test_a_fused_function_may_be_part_of_another():
    inner = fused(lambda x, y: (jnp.sin(x) * y, jnp.cos(x)))

    def outer(x, y):
        def body(x):
            a, b = inner(x, y)
            return 0.5 * (a + b) + 1e-3

        return jax.lax.while_loop(lambda x: jnp.abs(x) > 0.7, body, x + inner(y, x)[0])

    x, y = jnp.linspace(1, 3, 150), jnp.float32(0.4)
    found = jax.jit(jax.vmap(fused(outer), (0, None)))(x, y)
    inner = inner.__wrapped__
    np.testing.assert_allclose(found, jax.vmap(outer, (0, None))(x, y), rtol=1e-5, atol=1e-6)


def test_what_is_traced_around_it_may_hide_in_it():
    """Without a kernel then: it would be a number that its caller does not have yet."""

    def around(x, hidden):
        return jax.vmap(fused(lambda x: jnp.sin(x) * hidden))(x)

    x = jnp.linspace(0, 1, 70)
    np.testing.assert_allclose(jax.jit(around)(x, 3.0), 3 * np.sin(x), rtol=1e-6)
    slopes = jax.grad(lambda hidden: around(x, hidden).sum())(3.0)
    np.testing.assert_allclose(slopes, np.sin(x).sum(), rtol=1e-6)


def test_the_switch_leaves_the_function_to_xla(monkeypatch):
    monkeypatch.setenv(SWITCH, "off")
    program = jax.jit(jax.vmap(partial(fused(settle, fixed=1), 2), (0, None, 0)))
    assert "xla_cpu_small_call" not in program.lower(*arguments(9)).as_text()
    assert_same(program(*arguments(9)), batch_of(settle, 9), rtol=1e-6)


@pytest.mark.parametrize(
    ("width", "size"),
    [(1, None), (64, 64), (1, 100_001), pytest.param(300, 4096, marks=pytest.mark.long)],
)
def test_functions_too_costly_for_one_loop_compile(width, size):
    """XLA would go through a costly loop with several threads, which fails in a kernel."""

    def function(x, y):
        for _ in range(60):
            x = jnp.sin(x) * y + jnp.exp(-x * x)
        return x, jnp.sum(x)

    shape = (width,) if size is None else (size, width)
    x = jnp.linspace(0, 1, int(np.prod(shape)), dtype=jnp.float32).reshape(shape)
    kernel = fused(function) if size is None else jax.vmap(fused(function), (0, None))
    plain = function if size is None else jax.vmap(function, (0, None))
    y = jnp.float32(0.3)
    assert_same(jax.jit(kernel)(x, y), jax.jit(plain)(x, y), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("rows", [700, 20_000])
def test_members_with_large_arrays_of_their_own(rows, float64):
    """Blocks are smaller then; where one member is too large, there is no kernel."""
    function = fused(lambda table, x: jnp.sin(table[x.astype(int)]) * x)
    rng = np.random.default_rng(0)
    tables, x = rng.normal(size=(150, rows)), rng.uniform(0, rows - 1, 150)
    found = jax.jit(jax.vmap(function))(jnp.asarray(tables), jnp.asarray(x))
    wanted = np.sin(tables[np.arange(150), x.astype(int)]) * x
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


def primitives(function, *given) -> Counter[str]:
    """How often each primitive stands in a program, calls included."""
    found: Counter[str] = Counter()
    left = [jax.make_jaxpr(function)(*given).jaxpr]
    while left:
        for equation in left.pop().eqns:
            inner = equation.params.get("jaxpr")
            if inner is None:
                found[equation.primitive.name] += 1
            else:
                left.append(inner.jaxpr)
    return found


def test_what_a_maximum_compares_is_computed_once_and_other_cheap_numbers_again():
    """Its derivative asks which argument it equals: a repeated one may differ by a rounding."""

    def slope(x, y):
        most, back = jax.vjp(lambda x, y: jnp.maximum(x - y, x * y), x, y)
        return most, *back(x)

    def value(x, y):
        apart = x - y
        return jnp.exp(apart), jnp.sin(apart)

    given = jnp.float32(1.0), jnp.float32(0.25)
    for function, repeated in ((slope, 1), (value, 2)):
        traced = jax.make_jaxpr(function)(*given)
        assert primitives(grouped(traced), *given)["sub"] == repeated
        np.testing.assert_allclose(grouped(traced)(*given), function(*given), rtol=1e-6)
