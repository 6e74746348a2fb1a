"""What is proved of gaits, apart from the solver."""
