"""Kernels: how a batch of small models is computed fast on a CPU; results stay what they are.

Set the environment variable STICKSLIP_KERNELS to "off" and every function is compiled as XLA takes
it: the same numbers up to roundings, several times slower in a batch (docs/performance.md).
"""
