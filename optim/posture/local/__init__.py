"""Local improvement of a drive: convex models, gradients, evolution."""
