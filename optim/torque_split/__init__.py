"""The split of torque between the axles of a UGV in a fixed posture."""

from stickslip.optim.torque_split.family import Family
from stickslip.optim.torque_split.split import SPLIT_CRITERIA, Split, TorqueSplit

__all__ = ["SPLIT_CRITERIA", "Family", "Split", "TorqueSplit"]
