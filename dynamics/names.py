"""Names of the floors: known without JAX."""

SCENES = ("slippery", "grip", "firm", "wet", "ice-patch")
"""Names that `Scene.named` accepts."""
