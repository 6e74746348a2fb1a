"""How the closed linkage is made: circles, links, pins, bars, and how they move."""
