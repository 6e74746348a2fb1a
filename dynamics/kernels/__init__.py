"""Kernels: how a batch of small models is computed fast on a CPU; results stay what they are.

fused: a function over a batch as one kernel of XLA's CPU backend, in place of hundreds that each
take a microsecond to start; while loops and conditions for the members that need them.
scan: many steps in one kernel.
grouping: asks XLA for a kernel, and computes once what several results need.
jax_interface: the parts of JAX that are not public; derivative rules of batched functions.

Set the environment variable STICKSLIP_KERNELS to "off" and every function is compiled as XLA takes
it: the same numbers up to roundings, several times slower in a batch (docs/performance.md).
"""
