"""Names of the floors: known without JAX."""

SCENES = ("slippery", "grip", "firm", "wet", "ice-patch")
"""What `Scene.named` builds."""
