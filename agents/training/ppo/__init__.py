"""Proximal policy optimisation in JAX: a trainer, and populations for programs of one's own."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.training.ppo.algorithm import Rates, Sizes, settings_of
    from stickslip.agents.training.ppo.population import Population, train_population
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "population": ("Population", "train_population"),
            "algorithm": ("Rates", "Sizes", "settings_of"),
        },
    )

__all__ = ["Population", "Rates", "Sizes", "settings_of", "train_population"]
