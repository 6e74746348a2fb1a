"""What a walk is given, one or many: which numbers have a batch axis, in which precision."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.model import prepare
from stickslip.dynamics.scene import Patches

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.dynamics.biped.fidelity import Fidelity
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.scene import Scene

RANKS = {"mass": 1, "inertia": 1, "centre": 2}
"""Axes of a robot's fields that have any."""


class Given(NamedTuple):
    """Robot, scene, state and torques (or None), with each number's batch axis: 0 or None."""

    parts: tuple[BipedParams, Scene, BipedState, Any]
    axes: tuple[list[int | None], ...]
    """Of the leaves of each part."""
    torques: int | None
    """How many are given one by one."""

    def prepared(self, fidelity: Fidelity, dtype: str) -> Members:
        """The members with their robots prepared, in this precision."""
        with precision(dtype):
            params, scene, state, values = (_cast(part, dtype) for part in self.parts)
            state = replace(state, steps=jnp.asarray(self.parts[2].steps, jnp.int32))
            load = scene.payload
            axes = list(self.axes)
            pair = jax.tree.leaves((params, load))
            own = [*axes[0], *(() if load is None else axes[1][-1:])]
            build = partial(_prepare, jax.tree.structure((params, load)), fidelity)
            each = any(axis == 0 for axis in own)
            model = jax.jit(jax.vmap(build, in_axes=(own,)) if each else build)(pair)
            if load is not None:
                scene, axes[1] = replace(scene, payload=None), axes[1][:-1]
            leaves, tree = jax.tree.flatten((model, scene, state, values))
            first = [0 if each else None] * len(jax.tree.leaves(model))
            all_axes = [*first, *axes[1], *axes[2], *axes[3]]
            return Members(leaves, all_axes, tree, dtype)


class Members(NamedTuple):
    """Models, scenes, states and torques as leaves."""

    leaves: list[Any]
    axes: list[int | None]
    tree: Any
    dtype: str

    def every(self, walk: Callable[..., Any]) -> Callable[[list[Any]], Any]:
        """The walk of all members at once, as a function of the leaves."""

        run = self._of_leaves(walk)
        batched = any(axis == 0 for axis in self.axes)
        return jax.vmap(run, in_axes=(self.axes,)) if batched else run

    def one_by_one(self, walk: Callable[..., Any]) -> Any:
        """The walks of the members after each other: what one does not need is not computed."""

        run = self._of_leaves(walk)
        pairs = zip(self.leaves, self.axes, strict=True)
        size = next((np.shape(leaf)[0] for leaf, axis in pairs if axis == 0), None)

        def all_of(leaves):
            def member(index):
                pairs = zip(leaves, self.axes, strict=True)
                return run([leaf if axis is None else leaf[index] for leaf, axis in pairs])

            return run(leaves) if size is None else jax.lax.map(member, jnp.arange(size))

        with precision(self.dtype):
            return jax.tree.map(np.asarray, jax.jit(all_of)(self.leaves))

    def _of_leaves(self, walk: Callable[..., Any]) -> Callable[[list[Any]], Any]:
        return lambda leaves: walk(*jax.tree.unflatten(self.tree, leaves))


def precision(dtype: str):
    """A context with float64 where it is asked for, else with the user's own switch as it is."""
    return jax.enable_x64(True) if dtype == "float64" else nullcontext()


def gathered(params: BipedParams, scene: Scene, state: BipedState, torque: Any) -> Given:
    """Find the batch axes. ValueError for more than one, or of different lengths."""
    ranks = [RANKS.get(name, 0) for name in vars(params)]
    floor = 1 if isinstance(scene.floor, Patches) else 0
    count = len(jax.tree.leaves(scene.floor))
    own = [
        _axes("params", params, ranks),
        _axes("scene", scene, [floor] * count + [0]),
        _axes("state", state, [0] * 6),
    ]
    values, torques = None, None
    if torque is not None:
        values = jnp.asarray(torque)
        torques = None if values.ndim == 0 else values.shape[-1]
        own.append(_axes("torque", values, [min(values.ndim, 1)]))
    else:
        own.append([])
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
    return Given(parts, tuple(own), torques)


def _axes(name: str, part: Any, ranks: list[int]) -> list[int | None]:
    axes: list[int | None] = []
    for leaf, rank in zip(jax.tree.leaves(part), ranks, strict=False):
        more = np.ndim(leaf) - rank
        if more not in (0, 1):
            raise ValueError(
                f"{name} has a number of shape {np.shape(leaf)}; accepted: at most one batch axis"
            )
        axes.append(0 if more else None)
    return axes


def _cast(part: Any, dtype: str) -> Any:
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf), dtype), part)


def _prepare(tree: Any, fidelity: Fidelity, leaves: list[Any]):
    params, load = jax.tree.unflatten(tree, leaves)
    return prepare(params, fidelity=fidelity, payload=load)


def timed(walk: Callable[..., Any], members: Members, repeats: int) -> tuple[Any, float, float]:
    """The walks of all members; median seconds of warm runs for each; seconds of compiling."""
    with precision(members.dtype):
        begun = time.perf_counter()
        call = jax.jit(members.every(walk)).lower(members.leaves).compile()
        compiled = time.perf_counter() - begun
        found = jax.block_until_ready(call(members.leaves))
        taken = []
        for _ in range(repeats):
            begun = time.perf_counter()
            jax.block_until_ready(call(members.leaves))
            taken.append(time.perf_counter() - begun)
    path = jax.tree.map(np.asarray, found)
    size = max(1, int(np.prod(np.shape(path[0])[:-1])))
    return path, float(np.median(taken)) / size if taken else 0.0, compiled
