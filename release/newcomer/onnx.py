"""A policy of the package as an ONNX model."""

import sys

import onnx

from stickslip.cli import main

if main(["export", "biped-ice", "--out", "biped-ice.onnx"]):
    sys.exit("nothing was exported")
onnx.checker.check_model(onnx.load("biped-ice.onnx"), full_check=True)
