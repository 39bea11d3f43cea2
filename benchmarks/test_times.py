"""Rank tests by the CPU seconds of their phases and of the processes that they start, compilers included.

    python -m benchmarks.test_times                      # the quick tests, as `make test` runs them
    python -m benchmarks.test_times -m slow -o slow.tsv  # further arguments are those of pytest
    python -m benchmarks.test_times --read slow.tsv      # rank a stored run, without running it

A group is a test function with all its parameters, or the setup of what it is the first to need. Seconds of imports and
collection, which belong to no test, are the difference between the sum and the whole run.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

STORED = Path("build/test_times.tsv")


def cpu_seconds() -> float:
    """Return the CPU seconds of this process and of its children that have ended."""
    spent = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in spent)


class Clock:
    """A pytest plugin: workers measure each phase, and the process that collects their reports stores the seconds."""

    def __init__(self, config: pytest.Config) -> None:
        self._rows: list[tuple[str, str, float]] = []
        self._out = None if hasattr(config, "workerinput") else Path(config.getoption("--times"))

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Iterator[None]:
        now = cpu_seconds()
        before, item.stash[_BEFORE] = item.stash.get(_BEFORE, now), now
        outcome = yield
        outcome.get_result().user_properties.append(("cpu", now - before))  # type: ignore[attr-defined]

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        self._start = cpu_seconds()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        item.stash[_BEFORE] = self._start

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        seconds = [value for name, value in report.user_properties if name == "cpu"]
        self._rows.append((report.nodeid, report.when or "", float(seconds[-1])))

    def pytest_sessionfinish(self) -> None:
        if self._out is not None:
            self._out.parent.mkdir(parents=True, exist_ok=True)
            self._out.write_text("".join(f"{seconds:.4f}\t{phase}\t{test}\n" for test, phase, seconds in self._rows))


_BEFORE = pytest.StashKey[float]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that names the file of seconds."""
    parser.addoption("--times", default=str(STORED), help="where to store the CPU seconds of every phase")


def pytest_configure(config: pytest.Config) -> None:
    """Register the plugin in the main process and in each worker."""
    config.pluginmanager.register(Clock(config))


def groups(rows: Iterable[str], depth: str) -> list[tuple[float, int, str]]:
    """Return seconds, the number of tests, and the name of each group, most expensive first.

    Parameters
    ----------
    rows : iterable of str
        Lines of a stored run.
    depth : {"function", "file", "folder"}
        What a group is.
    """
    sums: dict[str, float] = defaultdict(float)
    tests: dict[str, set[str]] = defaultdict(set)
    for row in rows:
        seconds, phase, test = row.rstrip("\n").split("\t")
        path, _, function = test.partition("::")
        name = {"folder": path.rpartition("/")[0], "file": path}.get(depth)
        if name is None:
            name = f"{path}::{function.partition('[')[0]}" + (" (setup)" if phase == "setup" else "")
        sums[name] += float(seconds)
        tests[name].add(test)
    return sorted(((total, len(tests[name]), name) for name, total in sums.items()), reverse=True)


def main(arguments: list[str] | None = None) -> int:
    """Run tests, and print the ranking. Return the status of pytest."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.test_times", description=__doc__.partition("\n")[0])
    parser.add_argument("--by", choices=("function", "file", "folder"), default="function", help="what is ranked")
    parser.add_argument("--most", type=int, default=20, metavar="N", help="the length of the ranking [%(default)s]")
    parser.add_argument("-o", "--out", type=Path, default=STORED, metavar="FILE", help="where to store [%(default)s]")
    parser.add_argument("--read", type=Path, metavar="FILE", help="rank a stored run")
    options, pytest_arguments = parser.parse_known_args(arguments)
    status = 0
    if options.read is None:
        start, before = time.perf_counter(), cpu_seconds()
        command = [sys.executable, "-m", "pytest", "-n", "2", "--dist", "worksteal", "-p", "benchmarks.test_times"]
        status = subprocess.run([*command, f"--times={options.out}", *pytest_arguments]).returncode
        print(f"\n{time.perf_counter() - start:.0f} s, {cpu_seconds() - before:.0f} CPU seconds")
    ranking = groups((options.read or options.out).read_text().splitlines(), options.by)
    print(f"{sum(seconds for seconds, _, _ in ranking):.0f} CPU seconds in tests\n")
    print("| CPU s | tests | group |\n|--:|--:|---|")
    for seconds, n_tests, name in ranking[: options.most]:
        print(f"| {seconds:.1f} | {n_tests:,} | `{name}` |")
    return status


if __name__ == "__main__":
    sys.exit(main())
