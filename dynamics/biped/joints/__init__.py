"""Joint forces: the pin table, the Newton-Euler equations of all 24 bodies, their solution."""
