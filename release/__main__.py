"""Check that what would be released installs and works: `make release-check`.

    python -m release [--python 3.11 ...] [--only PART ...] [--extras NAME ...] [--out DIR]

Parts, in this order:

build    source distribution and wheel from the tracked files, what is in them, twine, the
         citation
resolve  for each Python: that versions are found for the extras which bring PyTorch, for `all` and
         for constraints.txt; for the Python after the last one, from wheels alone
install  for each Python: a clean environment with the core dependencies, one with each light extra,
         and in each the program of release/newcomer of its name, as a newcomer would write it
lowest   on the oldest Python: the lowest versions that pyproject.toml says, of the core and of
         each light extra, with the same programs
pytorch  for each Python: as install, the extras which bring PyTorch (on Linux 3 GB to fetch once,
         6 GB on the disk; --torch-backend cpu takes PyTorch's own builds for processors alone)
tests    the quick tests of the core rooms, out of the source distribution, with the lowest
         versions of the core

Needs uv (extra `release`) and the interpreters. Environments are made in a temporary folder and
deleted; a line for every check, a table of all at the end, and exit status 1 where one failed.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from release import artefacts, installs, lowest
from release.report import INTERRUPTED, Check, FailedError, Report
from release.tools import ROOT

PYTHONS = ("3.11", "3.12", "3.13")
PARTS = ("build", "resolve", "install", "lowest", "pytorch", "tests")


def parser() -> argparse.ArgumentParser:
    """What may be asked."""
    made = argparse.ArgumentParser(
        prog="python -m release",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("--python", nargs="+", default=list(PYTHONS), metavar="X.Y")
    made.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    named = ["core", *installs.light(), *installs.PYTORCH]
    made.add_argument("--extras", nargs="+", choices=named, default=named, metavar="NAME")
    made.add_argument(
        "--torch-backend", default="", metavar="NAME", help="uv's, for part pytorch: cpu, auto, ..."
    )
    made.add_argument("--out", type=Path, default=ROOT / "dist", help="of what is built")
    return made


def checks(given: argparse.Namespace, here: Path) -> Iterator[Check]:
    """What was asked, in order."""
    built = artefacts.paths(given.out)
    light = [name for name in given.extras if name not in installs.PYTORCH]
    heavy = [name for name in given.extras if name in installs.PYTORCH]
    if "build" in given.only:
        yield from artefacts.checks(*built)
    for python in given.python if "resolve" in given.only else ():
        yield from installs.resolved(python)
    if "resolve" in given.only:
        yield from installs.on_newer()
    for python in given.python if "install" in given.only else ():
        yield from installs.each(python, light, built[1], here)
    if "lowest" in given.only:
        yield from lowest.each(given.python[0], light, built[1], here)
    for python in given.python if "pytorch" in given.only else ():
        yield from installs.each(python, heavy, built[1], here, given.torch_backend)
    if "tests" in given.only:
        yield from lowest.tests(given.python[0], built, here)


def main(arguments: list[str] | None = None) -> int:
    """Run the parts; 0 where all is well, 1 where a check failed."""
    given = parser().parse_args(arguments)
    given.out = given.out.absolute()
    try:
        print(f"building into {given.out}", flush=True)
        artefacts.build(given.out)
    except FailedError as error:
        print(f"{error}\nnothing was built, nothing checked")
        return 1
    except KeyboardInterrupt:
        print("interrupted; nothing was built, nothing checked")
        return INTERRUPTED
    with tempfile.TemporaryDirectory(prefix="stickslip-release-") as folder:
        return Report().run(list(checks(given, Path(folder))))


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
