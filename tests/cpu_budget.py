"""A budget of CPU time for the tests, which a plugin of pytest holds: ``--cpu-budget SECONDS``.

What counts is the time of processors, that of processes which the tests start included, so that other work of the
machine fails no test. A loop is timed again and again between the tests: seconds are those of a core that takes
:data:`LOOP` seconds for it, so that a slow machine, or one whose cores are shared, has the same budget as a fast one.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest
from snakemake_runs import cpu_seconds_of_runs

LOOP = 0.01
"""Seconds that the calibration loop takes on the core that the budget is in seconds of."""

LONG = 0.3
"""CPU seconds of such a core from which a test is too long for every save."""

# CPU seconds of a process between two calibrations
_EVERY = 2.0
_SHOWN = 15


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--cpu-budget", type=float, metavar="SECONDS", help="fail if the tests take more of the processors"
    )
    parser.addoption(
        "--note-long",
        type=Path,
        metavar="FILE",
        help=f"add the names of tests that take more than {LONG:g} s of them",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(CpuBudget(config.getoption("--cpu-budget"), config.getoption("--note-long")))


def cpu_seconds() -> float:
    """Of this process and of those that it started and that have ended."""
    return sum(os.times()[:4]) + cpu_seconds_of_runs()


def calibration() -> float:
    """CPU seconds of a fixed piece of work: half of it Python's own, half of it arrays."""
    begun = time.thread_time()
    sum(n * n for n in range(60_000))
    values = np.arange(100_000.0)
    for _ in range(10):
        values = np.sqrt(values * values + 1.0)
    return time.thread_time() - begun


class CpuBudget:
    """Tells each test's time by its reports, which come together in one process, and adds them up."""

    def __init__(self, budget: float | None, noted: Path | None = None) -> None:
        self.budget, self.noted = budget, noted
        self.before = self.calibrated = 0.0
        self.taken: Counter[str] = Counter()
        self.loops: list[float] = []

    def pytest_collection_finish(self) -> None:
        self.before = cpu_seconds()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, Any, Any]:
        report = yield
        now = cpu_seconds()
        report.cpu_seconds, report.loops = now - self.before, []
        if now - self.calibrated > _EVERY:
            report.loops, self.calibrated = [calibration()], now
        self.before = cpu_seconds()
        return report

    def pytest_runtest_logreport(self, report: Any) -> None:
        # one of a process that crashed has none
        self.taken[report.nodeid] += getattr(report, "cpu_seconds", 0.0)
        self.loops += getattr(report, "loops", [])

    @property
    def seconds(self) -> float:
        """What the tests took, on the core of the budget."""
        return self.taken.total() * self._scale

    @property
    def _scale(self) -> float:
        return LOOP / median(self.loops) if self.loops else 1.0

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        in_a_worker = hasattr(session.config, "workerinput")
        if self.noted is not None and not in_a_worker:
            known = self.noted.read_text(encoding="utf-8").split() if self.noted.is_file() else []
            long = set(known) | {
                name.partition("[")[0] for name, taken in self.taken.items() if taken * self._scale > LONG
            }
            self.noted.write_text("".join(f"{name}\n" for name in sorted(long)), encoding="utf-8")
        if self.budget is not None and not in_a_worker and self.seconds > self.budget and not session.exitstatus:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if self.budget is None:
            return
        told = f"{self.seconds:.0f} CPU seconds of {self.budget:.0f} (a loop of {LOOP / self._scale * 1000:.1f} ms)"
        if self.seconds <= self.budget:
            terminalreporter.line(told)
            return
        terminalreporter.section("more CPU time than the tests may take", red=True)
        terminalreporter.line(f"{told}; the slowest:")
        for name, seconds in self.taken.most_common(_SHOWN):
            terminalreporter.line(f"{seconds * self._scale:8.1f} s  {name}")
