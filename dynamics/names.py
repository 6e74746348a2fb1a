"""Names of floors and grounds, known without JAX."""

SCENES = ("slippery", "grip", "firm", "wet", "ice-patch")
"""Names that `Scene.named` accepts."""

TRACKS = ("flat", "incline", "bump", "sinusoid", "ramp", "step", "ditch", "rough")
"""The named tracks: each is a constructor of Track, also reached by Track.named."""

RANDOM_TRACKS = ("random-bump", "random-rough", "random-mixed")
"""Names that `RandomTrack.named` accepts."""
