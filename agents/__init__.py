"""Baseline controllers, training, policy files and batch evaluation."""
