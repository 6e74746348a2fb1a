"""Names of the ground and of a rough one's arguments, known without JAX."""

TRACKS = ("flat", "incline", "bump", "sinusoid", "ramp", "step", "ditch", "rough")
"""The named tracks: each is a constructor of Track, also reached by Track.named."""

ROUGH_OPTIONS = ("band", "waves", "pieces")
"""Arguments of a rough track beside its constructor's own."""


RANDOM_TRACKS = ("random-bump", "random-rough", "random-mixed")
"""Names that `RandomTrack.named` accepts."""
