"""Where a run's time went: processor seconds of the dearest files and tests, at its end.

Seconds of the processor, those of commands that tests start included: they say what a test costs
also where others share the machine. Fixtures count where they are first asked for, so the test
that comes first pays for a program that a whole file uses.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator

import pytest

_seen = [0.0]


def processor_seconds() -> float:
    """Of this process and of the ended ones that it started."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def pytest_addoption(parser: pytest.Parser) -> None:
    text = "print that many of the dearest files and tests, in processor seconds"
    parser.addoption("--dearest", type=int, default=0, metavar="N", help=text)


def pytest_runtest_logstart() -> None:
    _seen[0] = processor_seconds()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Every report, of setup, call and teardown, holds its seconds; workers send them along."""
    report = yield
    now = processor_seconds()
    report.processor, _seen[0] = now - _seen[0], now
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    shown = terminalreporter.config.getoption("dearest")
    tests: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if hasattr(report, "processor"):
                tests[report.nodeid] += report.processor
    if not shown or not tests:
        return
    files: Counter[str] = Counter()
    for name, seconds in tests.items():
        files[name.partition("::")[0]] += seconds
    terminalreporter.section(f"processor seconds, {tests.total():.0f} in all")
    for what, sums in (("file", files), ("test", tests)):
        terminalreporter.write_line(f"\n| {what} | processor seconds |\n| --- | ---: |")
        for name, seconds in sums.most_common(shown):
            terminalreporter.write_line(f"| `{name}` | {seconds:.1f} |")
