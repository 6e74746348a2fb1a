"""The UGV's leg angles over a track: the problem, its criteria, and the methods made for it."""
