"""What a run may come to, in words: known without JAX."""

OUTCOMES = {
    "spent": "the budget ended it",
    "ended": "it ended by itself",
    "raised": "it raised an error",
    "timed out": "it was stopped at the time limit",
    "died": "its process ended",
}
EVENTS = {
    "violation": "the least violation so far, before there was a feasible point",
    "value": "a feasible point better than all before",
    "end": "the run's end",
}
"""What a row of the results tells of."""
FAILED = ("raised", "timed out", "died")
