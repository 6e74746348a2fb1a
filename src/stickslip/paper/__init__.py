"""The chapter's figures, computed again, and its claims beside the results.

`stickslip reproduce` runs `command.py`. `figure.py` declares the figures by name; a function for
each computes its data, its drawing and its claims with their verdicts.
"""
