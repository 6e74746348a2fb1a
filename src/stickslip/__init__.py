"""Two machines from one paper as reinforcement-learning environments and optimisation problems.

Importing this registers the Gymnasium environments.
"""

from importlib.metadata import version

from stickslip.envs.registration import register

__version__ = version("stickslip")

register()
