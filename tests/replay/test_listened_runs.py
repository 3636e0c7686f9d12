"""A recording does not depend on who listened: a model may ask whether its port leads anywhere."""

from pathlib import Path

import pytest

from firmware_runtime.devs.trace import trace
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs.session import Session
from tests.support.recorded import every_section, record
from tests.support.replayed import check_identical

Message = tuple[int, str, object]


@pytest.mark.slow
def test_a_run_with_a_trace_is_recorded_as_one_without_and_both_replay(tmp_path: Path) -> None:
    messages: list[Message] = []

    def listen(session: Session) -> None:
        trace(session.executive.simulator, lambda *message: messages.append(message))

    alone = record(tmp_path / "alone.recording", "tachobot", 1)
    traced = record(tmp_path / "traced.recording", "tachobot", 1, before=listen)
    assert "world.x" in {port for _, port, _ in messages}
    assert every_section(traced) == every_section(alone)
    for path in (alone, traced):
        assert "world.x" in read_recording(path).header.ports
        check_identical(path)
