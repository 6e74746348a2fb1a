"""Pages for a browser with episodes and tables."""
