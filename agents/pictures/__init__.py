"""Episodes as panels of curves, plots, animations and pages, of any machine."""
