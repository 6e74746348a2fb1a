"""A benchmark's numbers for a program: `python -m benchmarks.as_json MODULE`, and what that takes.

Standard output holds one JSON object: `written`, what the benchmark wrote, by file, and `tables`,
the rows that it showed, in that order. What it prints for people goes to standard error.
"""

from __future__ import annotations

import os
import runpy
import sys

from benchmarks.report import SHOWN, WRITTEN
from stickslip.records.table import json_text


def main(arguments: list[str]) -> int:
    """Run the module as Python's -m does; its exit status."""
    module, *rest = arguments
    own = os.dup(1)
    os.dup2(2, 1)  # of processes that the benchmark begins, too
    sys.argv = [module, *rest]
    status = 0
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        if isinstance(ended.code, str):
            print(ended.code, file=sys.stderr)
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    sys.stdout.flush()
    with open(own, "w", encoding="utf-8") as out:
        out.write(json_text({"written": WRITTEN, "tables": SHOWN}))
    return status


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
