"""What a command ends with, as a page for a browser: episodes, tables, curves and pictures."""
