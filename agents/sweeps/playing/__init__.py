"""How episodes are played in bulk: programs, threads, workers."""
