"""Whether what a tag names may be published.

    python -m release.tag [v1.2.3]

The tag is `v` and the version of pyproject.toml, which CITATION.cff has, too; the newest section
of CHANGELOG.md is of that version, has its date and leaves nothing under Unreleased. Exit status 1
with what is wrong.
"""

from __future__ import annotations

import argparse
import re
import sys
from datetime import date

from release.tools import PROJECT, ROOT


def main(arguments: list[str] | None = None) -> int:
    """Say what is wrong, or that nothing is."""
    version = PROJECT["version"]
    asked = argparse.ArgumentParser(
        prog="python -m release.tag",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    asked.add_argument(
        "tag", nargs="?", default=f"v{version}", help="left out: that of pyproject.toml"
    )
    tag = asked.parse_args(arguments).tag
    citation, changes = (
        (ROOT / name).read_text(encoding="utf-8") for name in ("CITATION.cff", "CHANGELOG.md")
    )
    found = [] if tag == f"v{version}" else [f"the tag is {tag}; pyproject.toml has v{version}"]
    if re.findall(r"(?m)^version: (.*)$", citation) != [version]:
        found.append(f"CITATION.cff does not have the version {version}")
    found += untold(changes, version)
    print("\n".join(found) or f"{tag} may be published")
    return 1 if found else 0


def untold(changes: str, version: str) -> list[str]:
    """What a changelog lacks that tells of everything up to a version."""
    first, *others = re.split(r"(?m)^## ", changes)[1:] or [""]
    left = [line for line in first.splitlines()[1:] if line.strip()]
    if first.partition("\n")[0] != "[Unreleased]":
        return ["CHANGELOG.md does not begin with the section [Unreleased]"]
    found = []
    if left:
        found.append(f"CHANGELOG.md has {len(left)} lines under Unreleased: {left[0]!r}, ...")
    newest = others[0].partition("\n") if others else ("", "", "")
    named = re.fullmatch(r"\[(.+)\] - (\S+)", newest[0].rstrip())
    if named is None or named[1] != version:
        return [*found, f"CHANGELOG.md has {newest[0]!r} where [{version}] is due, with its date"]
    if not (is_date(named[2]) and re.search(r"(?m)^- ", newest[2])):
        found.append(f"the section [{version}] of CHANGELOG.md lacks its date or what changed")
    return found


def is_date(text: str) -> bool:
    """A day of the calendar, as 2026-01-31."""
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


if __name__ == "__main__":
    sys.exit(main())
