"""Functional environments as other libraries expect them; no physics in here."""
