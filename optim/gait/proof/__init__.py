"""Proofs about gaits, independent of the solver."""
