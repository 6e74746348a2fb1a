"""Drives over a grid of leg angles as paths: the methods that search it, and their proofs."""
