"""Tables with units (`table.py`) and atomic file writes (`files.py`), for all folders.

And how their work is asked to end (`signals.py`).

It imports nothing else of this project.
"""
