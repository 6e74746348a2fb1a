"""The documentation site: what is generated for it, and its drawings."""
