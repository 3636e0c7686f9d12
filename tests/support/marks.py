"""What the marks mean, and what holds tests to them.

`real_time`: stands on the machine's clock: a robot that is driven in real time, processes that have
to take turns, a figure. Such tests run beside all others, which give way to them (`make test`), and
mostly wait; each has files, sockets and ports of its own. Whole folders of them are named here.
`ros`: needs rclpy, so the interpreter of `.venv-ros` (`make test-ros`); what is in `tests/ros2`.
`portable`: of golden files, recordings and the doubles' contract; whole folders. CI runs them on
the newest Python too, slow or not.
`slow`: takes over a quarter of a second. `make test-fast` runs neither these nor those in
real time.

How long a test takes by the clock says little where other programs run, so it is held to its mark
by processor time, its own and that of the processes it waited for: over a quarter of a second
without a mark is reported at the end, ten times that fails the session: processors that share their
parts with a busy neighbour take up to three times as long. What hypothesis reads once in a process,
up to three seconds of it, is no test's.
"""

import functools
import resource
import time
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import strategies

REAL_TIME = "real_time"
REAL_TIME_FOLDERS = frozenset({"safety", "ros2"})
PORTABLE_FOLDERS = frozenset({"contracts", "replay", "statistics"})
ROS_FOLDER = "ros2"
LIMIT_S = 0.25
FAILS_AT_S = 2.5
_TESTS = Path(__file__).parents[1]
_KEY = "processor_time_s"


def may_be_real_time(file: Path) -> bool:
    """Whether a file below `tests` can have a test in real time: by its folder or a mark in it."""
    is_in_folder = file.parts[0] in REAL_TIME_FOLDERS
    return is_in_folder or REAL_TIME in (_TESTS / file).read_text(encoding="utf-8")


def mark_by_folder(item: pytest.Item, folder: str) -> None:
    """Mark a test by the folder below `tests` that it stands in."""
    if folder in REAL_TIME_FOLDERS:
        item.add_marker(pytest.mark.real_time)
    if folder in PORTABLE_FOLDERS:
        item.add_marker(pytest.mark.portable)
    if folder == ROS_FOLDER:
        item.add_marker(pytest.mark.ros)


class Marks:
    """Measures every test, and at the end names those that take longer than their mark says."""

    def __init__(self) -> None:
        self._unmarked: dict[str, float] = {}

    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Let hypothesis read what it needs before its first test is measured."""
        if item.get_closest_marker("hypothesis"):
            _prepare_hypothesis()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, None, None]:
        """Let the report carry the test's processor time, from whatever worker."""
        before = _processor_time_s()
        try:
            return (yield)
        finally:
            item.user_properties.append((_KEY, _processor_time_s() - before))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test that took too long for one without a mark."""
        if report.when == "call" and not {"slow", "real_time"} & report.keywords.keys():
            spent = dict(report.user_properties).get(_KEY)
            if isinstance(spent, float) and spent > LIMIT_S:
                self._unmarked[report.nodeid] = spent

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Fail a session that would pass, where a test is far from its mark."""
        worst = max(self._unmarked.values(), default=0)
        if worst > FAILS_AT_S and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say which tests want the mark `slow`."""
        if self._unmarked:
            terminalreporter.section(f"over {LIMIT_S} s of processor time: mark these `slow`")
        for test, spent in sorted(self._unmarked.items(), key=lambda each: -each[1]):
            terminalreporter.line(f"{spent:.2f} s  {test}")
        if any(spent > FAILS_AT_S for spent in self._unmarked.values()):
            terminalreporter.section(f"failed: over {FAILS_AT_S} s without the mark `slow`")


@functools.cache
def _prepare_hypothesis() -> None:
    strategies.text().validate()  # Unicode's tables, and the constants in this project's modules


def _processor_time_s() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime
