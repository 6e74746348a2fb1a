"""Stations of a drive at its waypoints, evaluated with their slopes."""
