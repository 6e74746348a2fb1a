"""Pictures of the biped."""
