"""What recording adds to a control tick of TachoBot: calls of functions of `blackbox`."""

import sys
from collections import Counter
from pathlib import Path
from types import FrameType

import pytest

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.runs.start import start_session
from tests.support.counted_calls import CountingClock

FROM, TICK = 400 * MILLISECOND, 10 * MILLISECOND
TAPPED = {"begin": 1, "is_enabled": 1}
"""Within a step: that it begins, the interlock; ports and buses note without a further call."""
OF_A_WORLD = {"output": 1, "internal": 1, "external": 1}
"""A probe of the doubles' world, which a robot with chips has not."""
WRITING = {"end": 1}
"""Between two steps: it calls functions written in C, to encode a section, check it and copy it."""


def function_of_blackbox(frame: FrameType) -> str | None:
    """The name of a function of `blackbox`."""
    module = str(frame.f_globals.get("__name__"))
    return (
        frame.f_code.co_name if module.startswith("firmware_runtime.recording.blackbox.") else None
    )


@pytest.mark.slow
def test_a_recorded_tick_takes_a_call_for_each_thing_recorded_and_one_to_write(
    tmp_path: Path,
) -> None:
    clock = CountingClock(FROM, function_of_blackbox)
    session = start_session(
        registry.load("tachobot", ["imu.calibration_s=0.1"]),
        clock,
        doubles=True,
        statistics_path=None,
        recording=tmp_path / "tick.recording",
    )
    try:
        session.executive.run(FROM + 5 * TICK)
    finally:
        sys.setprofile(None)
        session.close()
    assert clock.passes[:4] == [Counter(TAPPED | OF_A_WORLD | WRITING)] * 4
