"""Gaits of the biped that are best of all that do not slip: convex programs, with their proofs.

`problem.py` says what is asked, `instance.py` puts it in numbers, `program.py` is the cone program,
`certificate.py` what its multipliers prove, `infeasible.py` names a limit that cannot be met,
`replay.py` walks a gait in simulation.
"""
