"""Check that what would be released installs and works: `make release-check`.

    python -m release [--python 3.11 ...] [--only PART ...] [--extras NAME ...] [--out DIR]

Parts, in this order:

build    source distribution and wheel from the tracked files, what is in them, twine, the
         citation
install  for each Python: a clean environment with the core dependencies, one with each extra, and
         in each the program of release/newcomer of its name, as a newcomer would write it
resolve  for each Python: that versions are found for the extras which bring PyTorch, and for `all`
lowest   on the oldest Python: the lowest versions that pyproject.toml says, of the core and of each
         extra, with the same programs
tests    the quick tests of the core rooms with the lowest versions of the core

Needs uv (extra `release`) and the interpreters. Environments are made in a temporary folder and
deleted; a line for every check, and exit status 1 where one failed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from release import artefacts, installs, lowest
from release.report import Report
from release.tools import ROOT

PYTHONS = ("3.11", "3.12", "3.13")
PARTS = ("build", "install", "resolve", "lowest", "tests")


def main(arguments: list[str] | None = None) -> int:
    """Run the parts; 0 where all is well, 1 where a check failed."""
    parser = argparse.ArgumentParser(
        prog="python -m release",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--python", nargs="+", default=list(PYTHONS), metavar="X.Y")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument(
        "--extras", nargs="+", choices=["core", *installs.extras()], help="of install and lowest"
    )
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="of what is built")
    given = parser.parse_args(arguments)
    report = Report()
    built = artefacts.build(given.out, report)
    if "build" in given.only:
        artefacts.look_into(*built, report)
    names = given.extras or ["core", *installs.light()]
    with tempfile.TemporaryDirectory(prefix="stickslip-release-") as folder:
        here = Path(folder)
        for python in given.python if "install" in given.only else ():
            installs.install_each(python, names, built[1], here, report)
        for python in given.python if "resolve" in given.only else ():
            installs.resolve_each(python, report)
        if "lowest" in given.only:
            lowest.install_each(given.python[0], names, built[1], here, report)
        if "tests" in given.only:
            lowest.run_tests(given.python[0], built[1], here, report)
    return report.end()


if __name__ == "__main__":
    sys.exit(main())
