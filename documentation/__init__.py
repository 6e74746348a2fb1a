"""Hooks and docstrings of the documentation site (mkdocs.yml)."""
