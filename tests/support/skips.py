"""`--forbid-skips`: a test that was skipped fails the session, which says why it was."""

import pytest

OPTION = "--forbid-skips"


def add_option(parser: pytest.Parser) -> None:
    """Add the option to pytest."""
    parser.addoption(OPTION, action="store_true", help="fail when a test was skipped")


class Forbidden:
    """Counts what was skipped, modules included; plugged in where that is forbidden."""

    def __init__(self) -> None:
        self._why: dict[str, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test that was skipped."""
        self._note(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Note a module that was skipped."""
        self._note(report)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Fail a session that would pass."""
        if self._why and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say what was skipped and why."""
        if self._why:
            terminalreporter.section("skipped, and none may be")
        for test, why in self._why.items():
            terminalreporter.line(f"{test}: {why}")

    def _note(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        if report.skipped and not hasattr(report, "wasxfail"):
            place = report.longrepr
            self._why[report.nodeid] = place[2] if isinstance(place, tuple) else str(place)
