"""Episodes played in batches, and tables of what came of them."""
