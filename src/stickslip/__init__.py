"""Two machines from one paper as reinforcement-learning environments and optimisation problems.

Importing this registers the Gymnasium environments. It imports neither JAX nor Gymnasium: the parts
are loaded when they are used.
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used
from stickslip.envs.registration import register, when_imported

if TYPE_CHECKING:
    from stickslip import agents as agents
    from stickslip import dynamics as dynamics
    from stickslip import envs as envs
    from stickslip import optim as optim
    from stickslip.version import __version__ as __version__
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)

when_imported("gymnasium", register)
