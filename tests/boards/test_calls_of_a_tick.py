"""What a control tick of TachoBot takes: calls of Python functions, and files that have them."""

import sys
from pathlib import Path
from types import FrameType

import pytest

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.runs.start import start_session
from tests.support.counted_calls import CountingClock

OURS = ("firmware_runtime", "firmware_drivers", "firmware_boards")
"""The packages that are there on a robot, too: not the doubles, nor what runs the test."""
MOST_CALLS = 260
MOST_FILES = 43
"""One of them, `devs/checked.py`, in virtual time only."""
CONTROLLED_FROM = 400 * MILLISECOND


def file_of_ours(frame: FrameType) -> str | None:
    """The file of a function of ours."""
    package, _, _ = str(frame.f_globals.get("__name__")).partition(".")
    return frame.f_code.co_filename if package in OURS else None


@pytest.mark.slow
def test_a_control_tick_takes_few_calls_in_few_files(tmp_path: Path) -> None:
    clock = CountingClock(CONTROLLED_FROM, file_of_ours)
    session = start_session(
        registry.load("tachobot", ["imu.calibration_s=0.1"]),
        clock,
        doubles=True,
        statistics_path=tmp_path / "tick.stats",
    )
    try:
        session.executive.run(CONTROLLED_FROM + 40 * MILLISECOND)
    finally:
        sys.setprofile(None)
        session.close()
    ticks = clock.passes[:4]
    assert [each.total() for each in ticks if each.total() > MOST_CALLS] == []
    assert [len(each) for each in ticks if len(each) > MOST_FILES] == []
    # the domain's own path is among them: a tick that reads no chip is none
    for file in ("imu.py", "mpu9250.py", "attitude.py", "pid.py", "allocation.py", "pca9685.py"):
        assert all(any(Path(name).name == file for name in tick) for tick in ticks)
