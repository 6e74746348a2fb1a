"""The plan of a race: which method runs on which instance with which seed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from stickslip.agents.optimisers.method import METHODS, methods_of
from stickslip.agents.optimisers.task import Task
from stickslip.dynamics.checks import require_choice, require_integer, require_kind
from stickslip.optim.instances.catalogue import suite
from stickslip.optim.instances.objective import OUTSIDE
from stickslip.optim.options import require_scalar

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from stickslip.agents.optimisers.method import Method, Optimiser
    from stickslip.optim.instances.exports import Foreign

MOST = 10**6
"""Runs of one race."""
ALL_SEEDS = 2**31 - 1


@dataclass(frozen=True)
class RacePlan:
    """All of a race; `RacePlan.of` checks it. limit: see `race`."""

    tasks: tuple[Task, ...]
    left_out: tuple[str, ...]
    limit: float

    @classmethod
    def of(
        cls,
        methods: Iterable[str] | Mapping[str, Optimiser | str | Method],
        instances: str | Iterable[str],
        *,
        budget: int | None,
        seconds: float | None,
        seeds: int | Sequence[int],
        outside: Literal["clip", "refuse"],
        limit: float,
    ) -> RacePlan:
        """See `race`. Instance after instance, so that what is compiled serves all its runs."""
        names = [instances] if isinstance(instances, str) else list(instances)
        for name in names:
            require_choice("instance", name, tuple(suite()))
        chosen = methods_of(methods)
        if budget is not None:
            require_integer("budget", budget, high=2**53)
        if seconds is not None:
            require_scalar("seconds", seconds, low=0.0, strict=True, accepted="a time > 0 [s]")
        if budget is None and seconds is None:
            raise ValueError("neither budget nor seconds; accepted: one of them at least")
        require_scalar("limit", limit, low=0.0, strict=True, accepted="a time > 0 [s]")
        require_choice("outside", outside, OUTSIDE)
        numbers = _seeds(seeds)
        for what, given in (("instance", names), ("method", [one.name for one in chosen])):
            if not given:
                raise ValueError(f"no {what}s; accepted: one at least")
            if twice := next((one for one in given if given.count(one) > 1), None):
                raise ValueError(f"{what} {twice} is given twice; accepted: once")
        if len(names) * len(chosen) * len(numbers) > MOST:
            raise ValueError(
                f"{len(names)} instances x {len(chosen)} methods x {len(numbers)} seeds; accepted: "
                f"{MOST:,} runs at most"
            )
        tasks, left_out = [], []
        for name in names:
            for one in chosen:
                if why := one.unsuited(suite()[name]):
                    left_out.append(f"{one.name} on {name}: {why}")
                    continue
                own = numbers if one.seeded else numbers[:1]
                tasks += [Task(name, one, seed, budget, seconds, outside) for seed in own]
        if not tasks:
            raise ValueError(
                f"no method takes any of the instances ({left_out[0]}); accepted: one that does"
            )
        return cls(tuple(tasks), tuple(left_out), float(limit))

    @cached_property
    def definition(self) -> dict[str, Foreign]:
        """What decides the results, as JSON values; of functions of the user's only their names."""
        methods = {one.method.name: one.method for one in self.tasks}
        first = self.tasks[0]
        found = {
            "instances": list(dict.fromkeys(one.instance for one in self.tasks)),
            "methods": {
                name: asdict(one) | {"function": one.function if name in METHODS else "yours"}
                for name, one in methods.items()
            },
            "seeds": sorted({one.seed for one in self.tasks}),
            "runs": len(self.tasks),
            "budget": first.budget,
            "seconds": first.seconds,
            "outside": first.outside,
        }
        return json.loads(json.dumps(found, allow_nan=False))

    @cached_property
    def digest(self) -> str:
        """Of the definition."""
        text = json.dumps(self.definition, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()


def _seeds(given: int | Sequence[int]) -> list[int]:
    """So many, from 0 on, or these."""
    if isinstance(given, int):
        return list(range(require_integer("seeds", given, high=MOST)))
    require_kind("seeds", given, (list, tuple, range), "how many, or a list of them")
    if not given or len(set(given)) < len(given):
        raise ValueError(f"seeds = {list(given)}; accepted: one at least, each once")
    return [require_integer("seed", one, low=0, high=ALL_SEEDS) for one in given]
