"""Sheets of plots and animations of any machine."""
