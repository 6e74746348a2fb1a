"""Pages of one file that show episodes and tables in a browser, without a network.

Python computes every position (`data.py` is what a page holds), the page only draws.
"""
