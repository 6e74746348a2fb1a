"""The reduced inertia functions: exact, and as polynomials fitted to them."""
