"""The Newton-Euler equations of all 24 bodies, and the ways to solve them."""
