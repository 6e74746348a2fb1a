"""The biped in other programs."""
