"""Sweeps: policies on tasks at every point of a grid, cell by cell, into a directory."""
