"""Names of the grounds that are drawn for every episode, known without JAX."""

RANDOM_TRACKS = ("random-bump", "random-rough", "random-mixed")
"""Names that `RandomTrack.named` accepts."""
