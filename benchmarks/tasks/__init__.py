"""The ladder of tasks measured: what is trivial, by hand, and the best that is known."""
