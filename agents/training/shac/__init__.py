"""Short-horizon actor-critic in JAX: policy gradients through the simulator's derivatives."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.training.shac.algorithm import ShortRates, ShortSizes, settings_of
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__, {"algorithm": ("ShortRates", "ShortSizes", "settings_of")}
    )

__all__ = ["ShortRates", "ShortSizes", "settings_of"]
