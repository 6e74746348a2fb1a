"""Docstrings as Markdown: what they lay out by indentation and line breaks stays laid out.

And what a package exports, where it says so by `import name as name`.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

CODE = re.compile(r"(`[^`]*`)")
BRACKETS = re.compile(r"\[([^]]*)\](?!\()")
"""Of units and shapes, `[K] [m]`: Markdown would take them for a link's."""


class AsWritten(griffe.Extension):
    """Changes the text of every docstring before mkdocstrings reads it."""

    def on_instance(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """See griffe.Extension."""
        if obj.docstring:
            obj.docstring.value = as_markdown(obj.docstring.value)

    def on_module_members(self, *, mod: griffe.Module, **kwargs: Any) -> None:
        """See griffe.Extension. An `__all__` that is written out stays."""
        if mod.exports is None and "loaded_when_used" in mod.imports:
            own = (name for name, home in mod.imports.items() if home.startswith("stickslip."))
            exports: Any = sorted(name for name in own if name != "loaded_when_used")
            mod.exports = exports


def as_markdown(text: str) -> str:
    """The text with lines that are set in from the others as code, and room before tables."""
    lines: list[str] = []
    inside = False
    for line in text.splitlines():
        indented = line.startswith("  ") if line.strip() else inside
        if indented != inside:
            if indented:
                lines += ["", "```text"]
            else:
                _close(lines)
            inside = indented
        before = lines[-1].strip() if lines else ""
        if line.startswith("|") and before and not before.startswith("|"):
            lines.append("")
        lines.append(line.removeprefix("  ") if inside else _plain_brackets(line))
    if inside:
        _close(lines)
    return "\n".join(lines)


def _plain_brackets(line: str) -> str:
    parts = CODE.split(line)
    parts[::2] = [BRACKETS.sub(r"\\[\1\\]", text) for text in parts[::2]]
    return "".join(parts)


def _close(lines: list[str]) -> None:
    """End a block of code, without the empty lines it would end with."""
    while not lines[-1].strip():
        lines.pop()
    lines += ["```", ""]
