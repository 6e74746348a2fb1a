"""Measurements: speed with accuracy beside it, sizes of compiled programs."""
