"""Tasks that never change: an environment and its parameters as plain values, under a fixed name.

tasks.json holds them; what changes a task's content gets a name with the next version.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from stickslip import envs
from stickslip.dynamics.checks import require_choice

if TYPE_CHECKING:
    from stickslip.envs.functional import FunctionalEnv, Plain

    Made: TypeAlias = tuple[FunctionalEnv[Any, Any], Any]
    """An environment of some machine, and its parameters."""

NAMESPACE = "stickslip/"
ENVIRONMENTS = {"BipedEnv": "biped", "UGVEnv": "ugv"}
"""Machine of each environment that a task may have."""
FIRST_NAMES = {"mean_rate": "commanded_rate"}
"""Names under which digests know parameters that were renamed since."""
TIERS = ("check", "core", "hard")
"""check: five seeds of PPO with its defaults score 0.9 in the mean; hard: no trained policy has
reached 0.8; core: the others."""
UGV_STEPS = 66
"""Steps of a UGV task: 8 m of ground less the vehicle's start, at most 0.1 m a step."""
DTYPE = "float32"
"""Precision of every task, whatever jax_enable_x64 is: a score is the same everywhere."""


@dataclass(frozen=True)
class TaskDefinition:
    """A named task.

    stem, version: the name is STEM-vVERSION. title: what is asked, in a few words. about: what
    makes it hard, in a sentence or two. environment: the class, by name. choices: its static
    options. parameters: what `make_params` takes, as plain values (see `from_plain` of the class).
    unit: of a return. tier: one of TIERS. ValueError for another environment or tier.
    """

    stem: str
    title: str
    about: str
    environment: str
    parameters: dict[str, Plain]
    choices: dict[str, Plain] = field(default_factory=dict)
    unit: str = "-"
    version: int = 0
    tier: str = "core"

    def __post_init__(self) -> None:
        require_choice("environment", self.environment, ENVIRONMENTS)
        require_choice("tier", self.tier, TIERS)

    @property
    def machine(self) -> str:
        """Name of the machine."""
        return ENVIRONMENTS[self.environment]

    @property
    def name(self) -> str:
        """Name in commands."""
        return f"{self.stem}-v{self.version}"

    @property
    def id(self) -> str:
        """Gymnasium's id."""
        return NAMESPACE + self.name

    @property
    def headline(self) -> str:
        """Name and title."""
        return f"{self.name}: {self.title}"

    @property
    def max_episode_steps(self) -> int:
        """Control steps of a whole episode."""
        limit, period = (self.parameters.get(name) for name in ("time_limit", "control_period"))
        if isinstance(limit, float) and isinstance(period, float):
            return round(limit / period)
        return UGV_STEPS

    @property
    def cost_limit(self) -> float | None:
        """Most that an episode may cost in the mean; None without a limit."""
        limit = self.parameters.get("cost_limit")
        return limit if isinstance(limit, float) else None

    @property
    def digest(self) -> str:
        """SHA-256 of the definition's canonical JSON, in hexadecimal."""
        own = ("environment", "choices", "parameters", "version")
        content = _with_first_names({one: getattr(self, one) for one in own} | {"dtype": DTYPE})
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    def make(self, autoreset: str = "disabled") -> Made:
        """The functional environment and its parameters."""
        kind = getattr(envs, self.environment)
        env = kind(**kind.from_plain(self.choices), autoreset=autoreset)
        return env, env.make_params(**kind.from_plain(self.parameters), dtype=DTYPE)


def _with_first_names(value: object) -> object:
    """The same values under the parameters' first names: a renamed one leaves a digest as it is."""
    if not isinstance(value, dict):
        return value
    return {FIRST_NAMES.get(name, name): _with_first_names(one) for name, one in value.items()}


_CONTENT = json.loads(Path(__file__).with_name("tasks.json").read_text(encoding="utf-8"))
TASKS: dict[str, TaskDefinition] = {
    one.name: one for one in (TaskDefinition(**entry) for entry in _CONTENT["tasks"])
}
"""Task definitions by name, the biped's first."""
WITHDRAWN: dict[str, str] = _CONTENT["withdrawn"]
"""Reasons of withdrawn versions, by name. They are listed and refused."""


def task_by_name(name: str) -> TaskDefinition:
    """The task of a name, with "stickslip/" before it or not. ValueError with the nearest one, and
    for a withdrawn version with the reason."""
    plain = name.removeprefix(NAMESPACE) if isinstance(name, str) else name
    if isinstance(plain, str) and plain in WITHDRAWN:
        raise ValueError(f"task = {withdrawal(plain)}")
    require_choice("task", plain, TASKS)
    return TASKS[plain]


def withdrawal(name: str) -> str:
    """Reason of a withdrawn version, and the version that is accepted in its place."""
    stem = name.rpartition("-v")[0]
    latest = [task.name for task in TASKS.values() if task.stem == stem]
    return f"{name} is withdrawn: {WITHDRAWN[name]}; accepted: {', '.join(latest) or 'no other'}"
