"""The gait as a convex program: what stands in it, and how it is solved."""
