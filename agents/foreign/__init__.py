"""Files that somebody else may have written: read within bounds, refused in words."""
