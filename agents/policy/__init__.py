"""Policies: the network, its file, the package's trained ones, ONNX, Stable-Baselines3."""
