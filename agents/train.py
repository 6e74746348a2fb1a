"""Training of any machine; see stickslip.agents.training."""

from stickslip.agents.training.run import train
from stickslip.agents.training.trained import Trained

__all__ = ["Trained", "train"]
