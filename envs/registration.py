"""The Gymnasium ids and what their keyword arguments mean."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import gymnasium

from stickslip.envs.biped import BipedEnv
from stickslip.envs.gym import GymEnv
from stickslip.envs.vector import GymVectorEnv

BIPED_ID = "stickslip/Biped-v0"


def make_biped(render_mode: str | None = None, **options: Any) -> GymEnv:
    """The single biped. Options: static choices of BipedEnv (setting, see_patch, ...)
    and entries of BipedEnv.make_params (scene, biped, randomisation, commanded_rate, ...)."""
    env, params = split_options(options | {"autoreset": options.get("autoreset", "disabled")})
    return GymEnv(env, params, render_mode)


def make_biped_vec(
    num_envs: int = 1,
    *,
    autoreset_mode: Any = "next_step",
    render_mode: str | None = None,
    **options: Any,
) -> GymVectorEnv:
    """n bipeds in one compiled call; options as for the single one."""
    if "autoreset" in options:
        raise ValueError(f"autoreset = {options['autoreset']!r}; accepted: autoreset_mode instead")
    env, params = split_options(options)
    return GymVectorEnv(env, params, num_envs, autoreset_mode, render_mode)


def split_options(options: dict[str, Any]) -> tuple[BipedEnv, Any]:
    """A BipedEnv and its parameters from one set of options; ValueError for unknown ones."""
    static = {field.name for field in fields(BipedEnv)}
    env = BipedEnv(**{name: value for name, value in options.items() if name in static})
    rest = {name: value for name, value in options.items() if name not in static}
    try:
        return env, env.make_params(**rest)
    except TypeError as error:
        raise ValueError(
            f"unknown option among {sorted(rest)}; accepted: those of BipedEnv "
            f"({', '.join(sorted(static))}) and of BipedEnv.make_params"
        ) from error


def register() -> None:
    """Tell Gymnasium of the environments; done by `import stickslip`, safe to repeat."""
    if BIPED_ID not in gymnasium.registry:
        gymnasium.register(
            BIPED_ID,
            entry_point="stickslip.envs.registration:make_biped",
            vector_entry_point="stickslip.envs.registration:make_biped_vec",
        )
