"""Run by test_wheel.py in an environment that holds the wheel and its core dependencies only.

Checks the installed package, never the checkout: run with `python -I` from elsewhere.
"""

import importlib.metadata
import sys
from pathlib import Path

OPTIONAL = {"torch", "matplotlib", "PIL", "pygame", "stable_baselines3", "rich"}
OPTIONAL |= {"tqdm", "jaxtyping", "pytest", "optax"}


def check(condition: object, message: str) -> None:
    """Stop with `message` unless `condition` holds (an assert could be optimised away)."""
    if not condition:
        sys.exit(f"FAILED: {message}")


def check_import() -> None:
    """Importing stickslip brings no optional package and leaves JAX's precision alone."""
    import jax

    before = jax.config.read("jax_enable_x64")
    import stickslip

    check(Path(stickslip.__file__ or "").is_relative_to(sys.prefix), "the checkout was imported")
    check((Path(stickslip.__file__ or "").parent / "py.typed").is_file(), "py.typed is missing")
    check(stickslip.__version__ == importlib.metadata.version("stickslip"), "versions differ")
    check(jax.config.read("jax_enable_x64") == before, "import stickslip switched jax_enable_x64")
    loaded = OPTIONAL & set(sys.modules)
    check(not loaded, f"import stickslip imported {sorted(loaded)}")


def check_gymnasium(env_id: str) -> None:
    """Make, reset and step one registered environment, and check its observations."""
    import gymnasium

    env = gymnasium.make(env_id)
    env.action_space.seed(0)
    observation, _ = env.reset(seed=0)
    check(observation in env.observation_space, f"{env_id}: first observation outside its space")
    for _ in range(3):
        observation, *_ = env.step(env.action_space.sample())
        check(observation in env.observation_space, f"{env_id}: observation outside its space")
    env.close()


def main() -> None:
    """Run all checks and name what was stepped."""
    check_import()
    import gymnasium

    env_ids = sorted(name for name in gymnasium.registry if name.startswith("stickslip/"))
    check("stickslip/Biped-v0" in env_ids, f"registered environments are {env_ids}")
    for env_id in env_ids:
        check_gymnasium(env_id)
    print("stepped", *env_ids)


if __name__ == "__main__":
    main()
