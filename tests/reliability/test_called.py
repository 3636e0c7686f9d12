"""Which function a line is in, and what a test file calls."""

import ast
from pathlib import Path

import pytest

from firmware_runtime.devs.time import format_time, seconds
from tests.reliability import called
from tests.reliability.called import Listener, functions_by_line, read_calls

SOURCE = """
LIMIT = 3

class Sonar:
    timeout = 2

    def ping(self) -> int:
        def later() -> int:
            return 1

        if later():
            return 2
        return 3


def alone() -> None:
    pass
"""


@pytest.mark.parametrize(
    ("line", "function"),
    [
        (2, None),
        (5, None),
        (9, "x.py:Sonar.ping.<locals>.later"),
        (12, "x.py:Sonar.ping"),
        (17, "x.py:alone"),
    ],
)
def test_a_line_is_in_the_innermost_function_around_it(line: int, function: str | None) -> None:
    assert functions_by_line("x.py", ast.parse(SOURCE)).get(line) == function


def test_what_the_tests_of_a_file_call_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.setattr(called, "FOLDER", tmp_path)
    listener = Listener()
    listening = listener.pytest_runtest_protocol(request.node)
    next(listening)
    assert seconds(2.0) == 2_000_000_000
    listening.close()
    assert format_time(0)
    listener.pytest_sessionfinish()
    [(file, calls)] = read_calls().items()
    assert file == request.node.location[0]
    assert calls.functions == {"firmware_runtime/devs/time.py:seconds"}
