"""The gait as a convex program: its limits and numbers, the solver, and the proofs."""
