"""Dynamic programming over a grid of states, for any deterministic process of few coordinates."""
