"""What all folders write with: rows with units as text (`table.py`), files whole (`files.py`).

And how their work is asked to end (`signals.py`).

It imports nothing else of this project.
"""
