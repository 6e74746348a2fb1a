"""Task definition: an environment and its parameters as plain values, under a fixed name."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from stickslip import envs
from stickslip.dynamics.plain_checks import require_choice, require_kind, shown

if TYPE_CHECKING:
    from typing import Any

    from stickslip.envs.functional import FunctionalEnv
    from stickslip.envs.plain import Plain

Made: TypeAlias = "tuple[FunctionalEnv[Any, Any], Any]"
"""An environment of some machine, and its parameters."""
NAMESPACE = "stickslip/"
ENVIRONMENTS = {"BipedEnv": "biped", "UGVEnv": "ugv"}
"""Whose a task may be, and the machine of each."""
DRIVE_STEPS = 66
"""Steps of a UGV task: 8 m of ground less the vehicle's start, at most 0.1 m a step."""
DTYPE = "float32"
"""Precision of every task, whatever jax_enable_x64 is: a score is the same everywhere."""


@dataclass(frozen=True)
class TaskDefinition:
    """A task. Its content never changes; what changes it gets a name with the next version.

    stem, version: the name is STEM-vVERSION. title: what is asked, in a few words. about: what
    makes it hard, in a sentence or two. machine: whose. environment: the class, by name. choices:
    its static options. parameters: what `make_params` takes, as plain values (see `from_plain` of
    the class). unit: of a return. ValueError for names that do not go together.
    """

    stem: str
    title: str
    about: str
    machine: str
    environment: str
    parameters: dict[str, Plain]
    choices: dict[str, Plain] = field(default_factory=dict)
    unit: str = "-"
    version: int = 0

    def __post_init__(self) -> None:
        require_choice("environment", self.environment, ENVIRONMENTS)
        require_choice("machine", self.machine, (ENVIRONMENTS[self.environment],))
        if not (isinstance(self.stem, str) and self.stem.isidentifier()):
            raise ValueError(
                f"stem = {shown(self.stem)}; accepted: letters, digits and _, beginning with none "
                "of the digits"
            )
        for name in ("parameters", "choices"):
            require_kind(name, getattr(self, name), dict, "a dict of plain values")

    @property
    def name(self) -> str:
        """Name in commands."""
        return f"{self.stem}-v{self.version}"

    @property
    def id(self) -> str:
        """Gymnasium's id."""
        return NAMESPACE + self.name

    @property
    def max_episode_steps(self) -> int:
        """Control steps of a whole episode."""
        limit, period = (self.parameters.get(name) for name in ("time_limit", "control_period"))
        if isinstance(limit, float) and isinstance(period, float):
            return round(limit / period)
        return DRIVE_STEPS

    @property
    def digest(self) -> str:
        """SHA-256 of the definition's canonical JSON, in hexadecimal."""
        content = {
            "environment": self.environment,
            "choices": self.choices,
            "parameters": self.parameters,
            "dtype": DTYPE,
            "version": self.version,
        }
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    def make(self, autoreset: str = "disabled") -> Made:
        """The functional environment and its parameters."""
        kind = getattr(envs, self.environment)
        env = kind(**kind.choices_from_plain(self.choices), autoreset=autoreset)
        return env, env.make_params(**kind.from_plain(self.parameters), dtype=DTYPE)
