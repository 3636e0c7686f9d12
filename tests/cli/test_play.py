"""`play`: a part that refuses has said why, and its status is that of all."""

import pytest

from firmware_runtime.cli.commands import play
from firmware_runtime.errors import Status
from firmware_runtime.system.signals import until_signal
from tests.support.command import Command


@pytest.mark.slow
def test_a_part_that_refuses_has_said_why(capfd: pytest.CaptureFixture[str]) -> None:
    words = ["view", "nowhere.recording", "--no-browser"]
    with (
        until_signal() as signal,
        pytest.raises(SystemExit) as ended,
        play._running(words, "http", signal),
    ):
        pass
    said = capfd.readouterr()
    assert ended.value.code == Status.BAD_INPUT
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "nowhere.recording" in said.err


def test_a_port_that_is_none_is_refused_before_anything_starts(command: Command) -> None:
    said = command.refused("play", "--port", "x")
    assert said.endswith("--port: 'x': expected a whole number from 0 to 65535\n")
