"""The closed linkage: circles, links, pins, bars, and their motion."""
