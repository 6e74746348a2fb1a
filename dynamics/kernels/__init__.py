"""Kernels: how a batch of small models is computed fast on a CPU; results stay what they are.

fused: a function over a batch as one kernel of XLA's CPU backend, in place of hundreds that each
take a microsecond to start; `fused_scan`: many steps in one kernel.
one_kernel: asks XLA for a kernel, and knows what no kernel holds.
grouping: computes once what several results need.
lanes: while loops and conditions for the members that need them (lane compaction).
batch_axes: derivative rules of batched functions.
jax_interface: the parts of JAX that are not public.

Set the environment variable STICKSLIP_KERNELS to "off" and every function is compiled as XLA takes
it: the same numbers up to roundings, several times slower in a batch (docs/performance.md).
"""
