"""Sweeps: many points of many tasks under many policies, chunk by chunk, into a directory."""
