"""Pinocchio is there."""

import sys

import pinocchio

if pinocchio.buildSampleModelManipulator().nq != 6:
    sys.exit("Pinocchio's own arm is not as it says")
