"""Other learners on the same environments: how long each takes to the same score."""
