"""What all folders write with: rows with units as text (`table.py`), files whole (`files.py`).

It imports nothing else of this project.
"""
