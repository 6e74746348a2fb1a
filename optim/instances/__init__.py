"""Instances for optimisers: fixed problems under fixed names, and one objective for every library.

from stickslip.optim import suite

one = suite()["ugv-bump-energy-d64-v2"]
objective = one.objective(budget=2000)
record = objective.minimise(my_optimiser)       # which calls objective(x)
print(record.best, one.best_known, one.lower_bound)
"""
