"""What a sweep may vary of a machine's task, and in which units."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.sweeps.fields import Way, number_at, numbers_in, with_number
from stickslip.agents.sweeps.telling.told import Told
from stickslip.dynamics.checks import nearest, shown
from stickslip.dynamics.numeric import float_type

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from jaxtyping import PyTree

    from stickslip.dynamics.numeric import Number

LISTED = 24
"""Names in a message."""


class Swept:
    """What axes may set of the parameters of a machine's task; this one does for most machines.

    A name is dotted, as "task.mass", or its end where that is told from others by the order of
    `parts`. Pure but for the messages: `put` is called with traced values.
    """

    units: ClassVar[Mapping[str, str]] = {}
    """Of fields, by their dotted name without entries' places, or by its last word."""
    kept: ClassVar[Mapping[str, str]] = {"reward": "-", "duration": "s"}
    """What is written of an episode, of what the machine's measures keep, and its unit."""
    finished: ClassVar[tuple[str, ...]] = ()
    """Those of `kept` that are of a whole episode: summaries are over the episodes that did not
    fail, NaN where all did."""
    told: ClassVar[Told] = Told()
    """How sweeps are told of; what slid and the way are two of `kept`."""
    short: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Names that set several fields at once."""
    structure: ClassVar[Mapping[str, str]] = {}
    """Names of what is compiled into the program, and what to do instead of an axis."""

    def parts(self, params: PyTree) -> dict[str, PyTree]:
        """Trees of numbers by the first word of their names; what matters most comes first."""
        return {"task": {one.name: getattr(params, one.name) for one in fields(params) if one.init}}

    def with_parts(
        self, params: PyTree, parts: Mapping[str, PyTree], names: Iterable[str]
    ) -> PyTree:
        """The parameters with these parts. names: dotted, of the fields that are not as before."""
        del names
        return replace(params, **parts["task"])

    def opened(self, params: PyTree, names: Iterable[str]) -> PyTree:
        """Parameters in whose structure the named axes, as they are given, have a place."""
        del names
        return params

    def require_within(self, params: PyTree) -> None:
        """Raise ValueError where the task would not take these parameters; they are concrete."""

    def kept_units(self, env: PyTree) -> Mapping[str, str]:
        """`kept` of an environment."""
        del env
        return self.kept

    def unit(self, name: str) -> str:
        """Of a dotted name."""
        words = [word for word in name.split(".") if not word.isdigit()]
        return self.units.get(".".join(words), self.units.get(words[-1], "-"))

    def targets(self, params: PyTree, name: str) -> tuple[str, ...]:
        """The dotted fields that an axis sets. ValueError for an unknown name and a structure."""
        self.require_no_structure([name])
        known = self.known(params)
        if name in self.short:
            missing = [one for one in self.short[name] if one not in known]
            if not missing:
                return self.short[name]
        elif name in known:
            return (name,)
        elif ends := [one for one in known if one.partition(".")[2] == name]:
            return (ends[0],)
        shorter = dict.fromkeys(one.partition(".")[2] for one in known)
        near = nearest(name, [*known, *shorter, *self.short])
        first = [*self.short, *shorter][:LISTED]
        raise ValueError(
            f"axis {shown(name)} is unknown here{near}; accepted: {', '.join(first)}"
            f"{', ...' if len(shorter) > LISTED else ''}; or with the part in front: "
            f"{', '.join(f'{part}.NAME' for part in self.parts(params))}"
        )

    def require_no_structure(self, names: Iterable[str]) -> None:
        """Raise ValueError for axes that would change what is compiled, whatever their values."""
        for name in names:
            if name in self.structure:
                raise ValueError(
                    f"axis {name} changes the compiled program, not a number in it; accepted: "
                    f"{self.structure[name]}"
                )

    def known(self, params: PyTree) -> dict[str, Way]:
        """All fields that an axis may set, by their dotted names."""
        return {name: way for name, way in numbers_in(self.parts(params)).items() if "." in name}

    def put(self, params: PyTree, values: Mapping[str, Number]) -> PyTree:
        """The parameters with some fields, by dotted names, set to numbers, traced or not."""
        import jax.numpy as jnp

        if not values:
            return params
        kind, parts, known = float_type(params), self.parts(params), self.known(params)
        for name, value in values.items():
            parts = with_number(parts, known[name], jnp.asarray(value, kind))
        return self.with_parts(params, parts, values)

    def before(self, params: PyTree, name: str) -> float:
        """What a field is without an axis."""
        return float(number_at(self.parts(params), self.known(params)[name]))
