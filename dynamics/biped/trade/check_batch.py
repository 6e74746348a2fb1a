"""Arguments of one walk or a batch: batch axes and precision."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import PLAIN_NDIM
from stickslip.dynamics.biped.model import prepare
from stickslip.dynamics.scene import Patches

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence

    from stickslip.dynamics.biped.model import BipedModel, Fidelity
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.scene import Scene

    Leaves = Sequence[Any]
    """Leaves of a tree, in its order."""

Grown = TypeVar("Grown")


class WalkBatch(NamedTuple):
    """Robot, scene, state and torques (or None), with each number's batch axis: 0 or None."""

    parts: tuple[BipedParams, Scene, BipedState, Any]
    axes: tuple[tuple[int | None, ...], ...]
    """Batch axes of the leaves of each part."""
    torques: int | None
    """Number of values that are batched."""

    def prepared(self, fidelity: Fidelity, dtype: str) -> Members:
        """The members with their robots prepared, in this precision."""
        with precision(dtype):
            params, scene, state, values = (_cast(part, dtype) for part in self.parts)
            state = replace(state, steps=jnp.asarray(self.parts[2].steps, jnp.int32))
            leaves, tree = jax.tree.flatten((params, scene.payload))
            own, floor = self.axes[0], self.axes[1]
            if scene.payload is not None:
                own, floor = (*own, floor[-1]), floor[:-1]
                scene = replace(scene, payload=None)
            model = _mapped(_prepared, fidelity, False, tree, own, tuple(leaves))
            each = (0 if 0 in own else None,) * len(jax.tree.leaves(model))
            leaves, tree = jax.tree.flatten((model, scene, state, values))
            return Members(leaves, (*each, *floor, *self.axes[2], *self.axes[3]), tree, dtype)


class Members(NamedTuple):
    """Models, scenes, states and torques as leaves."""

    leaves: list[Any]
    axes: tuple[int | None, ...]
    tree: Any
    dtype: str

    def run(self, walk: Callable[..., Grown], options: Hashable, serial: bool = False) -> Grown:
        """walk(options, model, scene, state, torques) of all members.

        serial: one after the other, so that a branch that a member does not take costs nothing.
        """
        with precision(self.dtype):
            return jax.block_until_ready(
                _mapped(walk, options, serial, self.tree, self.axes, tuple(self.leaves))
            )

    @property
    def size(self) -> int | None:
        """Number of members; None for a single walk without a batch axis."""
        pairs = zip(self.leaves, self.axes, strict=True)
        return next((np.shape(leaf)[0] for leaf, axis in pairs if axis == 0), None)


def _prepared(fidelity: Fidelity, params: BipedParams, load: Any) -> BipedModel:
    return prepare(params, fidelity=fidelity, payload=load)


@partial(jax.jit, static_argnums=(0, 1, 2, 3, 4))
def _mapped(
    function: Callable[..., Grown],
    options: Hashable,
    serial: bool,
    tree: Any,
    axes: tuple[int | None, ...],
    leaves: Leaves,
) -> Grown:
    """function(options, *parts) along the batched leaves; the others are shared."""

    def one(leaves: Leaves) -> Grown:
        return function(options, *jax.tree.unflatten(tree, leaves))

    if 0 not in axes:
        return one(leaves)

    def member(own: Leaves) -> Grown:
        mine = iter(own)
        pairs = zip(leaves, axes, strict=True)
        return one([next(mine) if axis == 0 else leaf for leaf, axis in pairs])

    own = [leaf for leaf, axis in zip(leaves, axes, strict=True) if axis == 0]
    return jax.lax.map(member, own) if serial else jax.vmap(member)(own)


def precision(dtype: str):
    """A context with float64 where it is asked for, else with the user's own switch as it is."""
    return jax.enable_x64(True) if dtype == "float64" else nullcontext()


def gathered(params: BipedParams, scene: Scene, state: BipedState, torque: Any) -> WalkBatch:
    """Find the batch axes. ValueError for more than one, or of different lengths."""
    floor = 1 if isinstance(scene.floor, Patches) else 0
    count = len(jax.tree.leaves(scene.floor))
    own = [
        _axes("params", params, PLAIN_NDIM),
        _axes("scene", scene, [floor] * count + [0]),
        _axes("state", state, [0] * 6),
    ]
    values, torques = None, None
    if torque is not None:
        values = jnp.asarray(torque)
        torques = None if values.ndim == 0 else values.shape[-1]
        own.append(_axes("torque", values, [min(values.ndim, 1)]))
    else:
        own.append(())
    parts = (params, scene, state, values)
    sizes = {
        np.shape(leaf)[0]
        for part, axes in zip(parts, own, strict=True)
        for leaf, axis in zip(jax.tree.leaves(part), axes, strict=True)
        if axis == 0
    }
    if len(sizes) > 1:
        raise ValueError(
            f"batches of {', '.join(map(str, sorted(sizes)))} members in one call; accepted: "
            "arrays with one and the same leading axis, or none"
        )
    return WalkBatch(parts, tuple(own), torques)


def _axes(name: str, part: Any, ranks: list[int]) -> tuple[int | None, ...]:
    axes: list[int | None] = []
    for leaf, rank in zip(jax.tree.leaves(part), ranks, strict=False):
        more = np.ndim(leaf) - rank
        if more not in (0, 1):
            raise ValueError(
                f"{name} has a number of shape {np.shape(leaf)}; accepted: at most one batch axis"
            )
        axes.append(0 if more else None)
    return tuple(axes)


def _cast(part: Any, dtype: str) -> Any:
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf), dtype), part)


def timed(
    members: Members, walk: Callable[..., Grown], options: Hashable, repeats: int
) -> tuple[Grown, float, float]:
    """The walks of all members; median seconds of a warm run for each; seconds until warm."""
    begun = time.perf_counter()
    found = members.run(walk, options)
    first = time.perf_counter() - begun
    taken = []
    for _ in range(repeats):
        begun = time.perf_counter()
        members.run(walk, options)
        taken.append(time.perf_counter() - begun)
    again = float(np.median(taken))
    return found, again / (members.size or 1), max(0.0, first - again)
