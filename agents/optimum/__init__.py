"""The best that can be earned in an environment, by dynamic programming on its own step."""
