"""Pytrees of two classes have two structures; programs that run once keep their numbers."""

from dataclasses import dataclass, field, fields
from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import register_pytree
from stickslip.dynamics.pytrees import run_once
from tests.dataclasses_found import dataclasses_of_the_package
from tests.documents import ROOT

PARTS = ("agents", "benchmarks", "docs", "documentation", "dynamics", "envs", "notebooks", "optim")
OTHER = "@jax.tree_util." + register_pytree.__name__.replace("pytree", "dataclass")


@register_pytree
@dataclass(frozen=True)
class Parted:
    """A part that is structure, and one that follows from another."""

    kind: str = field(metadata={"static": True})
    number: float
    twice: float = field(init=False)

    def __post_init__(self):
        object.__setattr__(self, "twice", 2 * self.number)


def blank(kind: type):
    """An instance with the same in every field, and whether it is a pytree's node."""
    made = object.__new__(kind)
    for one in fields(kind):
        object.__setattr__(made, one.name, () if one.metadata.get("static") else 0.0)
    return made, not jax.tree_util.all_leaves([made])


def test_no_two_classes_of_the_package_have_one_structure():
    kinds = sorted(dataclasses_of_the_package(), key=lambda one: (one.__module__, one.__name__))
    nodes = [made for made, is_node in map(blank, kinds) if is_node]
    assert len(nodes) > 50
    alike = [
        (type(a).__name__, type(b).__name__)
        for a, b in combinations(nodes, 2)
        if jax.tree.structure(a) == jax.tree.structure(b)
    ]
    assert alike == []


def test_structures_tell_static_fields_and_name_paths():
    tree = Parted("a", 1.0)
    leaves, structure = jax.tree.flatten(tree)
    assert leaves == [1.0, 2.0]
    assert structure == jax.tree.structure(Parted("a", 5.0)) != jax.tree.structure(Parted("b", 1.0))
    assert hash(structure) == hash(jax.tree.structure(Parted("a", 5.0)))
    paths = [jax.tree_util.keystr(path) for path, _ in jax.tree_util.tree_leaves_with_path(tree)]
    assert paths == [".number", ".twice"]


def test_nothing_is_registered_by_jaxs_own_decorator():
    """Its structures compare equal for two classes of as many fields."""
    files = [one for name in PARTS for one in (ROOT / name).rglob("*") if one.is_file()]
    told = [one for one in files if one.suffix in (".py", ".md", ".ipynb", ".js")]
    assert len(told) > 200
    assert [one for one in told if OTHER in one.read_text(encoding="utf-8")] == []


def wave(order, x):
    for _ in range(order):
        x = jnp.sin(x) + 0.5 * x**2
    return x


def test_the_value_is_the_functions_own_in_and_outside_of_transformations(dtype):
    quick, x = run_once(wave, fixed=1), jnp.linspace(0.0, 1.0, 7, dtype=dtype)
    near = {"rtol": 50 * float(jnp.finfo(dtype).eps)}
    expected = wave(3, x)
    assert quick(3, x).dtype == dtype
    np.testing.assert_allclose(quick(3, x), expected, **near)
    np.testing.assert_allclose(jax.jit(lambda x: quick(3, x))(x), expected, **near)
    np.testing.assert_allclose(jax.vmap(lambda x: quick(3, x))(x), expected, **near)
    slope = jax.vmap(jax.grad(lambda x: quick(3, x)))(x)
    np.testing.assert_allclose(slope, jax.vmap(jax.grad(lambda x: wave(3, x)))(x), **near)
