"""What a control tick of TachoBot takes, recorded: calls of Python functions, and their files.

What a double and its world call is not counted: no robot has it.
"""

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import Clock, MonotonicClock, S, VirtualClock
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.statistics import Statistics


class Counting:
    """Before a clock: `passes` has the calls from an instant on, by what `key` says of a frame.

    None is none. Whoever runs it ends the count by `sys.setprofile(None)`.
    """

    passes: list[Counter[str]]

    def __init__(self) -> None:
        super().__init__()
        self.passes = []
        self._since = NEVER
        self._key: Callable[[FrameType], str | None] = str

    def count(self, since: int, key: Callable[[FrameType], str | None]) -> None:
        """Count from an instant on."""
        self._since, self._key = since, key

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Begin another pass."""
        sys.setprofile(None)
        clock: Any = super()
        ready: list[S] = clock.wait(until, sources)
        if clock.now() >= self._since:
            self.passes.append(Counter())
            sys.setprofile(self._count)
        return ready

    def _count(self, frame: FrameType, event: str, _argument: object) -> None:
        key = self._key(frame) if event == "call" else None
        if key is not None:
            self.passes[-1][key] += 1


class CountingClock(Counting, VirtualClock):
    """In virtual time."""

    def __init__(self, since: int, key: Callable[[FrameType], str | None]) -> None:
        super().__init__()
        self.count(since, key)


pytestmark = pytest.mark.slow

OURS = ("firmware_runtime", "firmware_drivers", "firmware_boards")
"""The packages that are there on a robot, too."""
OF_A_WORLD = "tapped_world."
"""Functions around those of a world's models, which a robot with chips has not."""
MOST_CALLS = 115
MOST_FILES = 27
MOST_WHEN_LATE = 250
"""So many more, with what is done in the slack after it."""
CONTROLLED_FROM = 400 * MILLISECOND
RECORDED = {"begin": 1, "output": 1, "internal": 1, "external": 1, "end": 1}
"""Calls within `blackbox`: that a step begins, a probe of the doubles' world, and, between two
steps, one that calls C to encode a section, check it and copy it. Ports, buses and the interlock
note without a further call.
"""


def file_of_ours(frame: FrameType) -> str | None:
    """The file of a function of ours, unless a double has called it."""
    package, _, _ = str(frame.f_globals.get("__name__")).partition(".")
    if package not in OURS or OF_A_WORLD in frame.f_code.co_qualname:
        return None
    caller = frame.f_back
    while caller is not None:
        if str(caller.f_globals.get("__name__")).startswith("sim_doubles"):
            return None
        caller = caller.f_back
    return frame.f_code.co_filename


def function_of_blackbox(frame: FrameType) -> str | None:
    module = str(frame.f_globals.get("__name__"))
    of_it = module.startswith("firmware_runtime.recording.blackbox.")
    return frame.f_code.co_name if of_it else None


class InVirtualTime(Counting, VirtualClock):
    """Counts from one wait to the next."""


class InRealTime(Counting, MonotonicClock):
    """The same; each third wait is late."""

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        stall = 4 * MILLISECOND if len(self.passes) % 3 == 2 else 0
        return super().wait(until + stall, sources)


def ticks_of(clock: Clock, folder: Path) -> Statistics:
    """Run a recorded robot until some ticks after its control has begun."""
    session = start_session(
        registry.load("tachobot", ["imu.calibration_s=0.1"]),
        clock,
        doubles=True,
        statistics_path=folder / "tick.stats",
        recording=folder / "tick.recording",
    )
    try:
        session.executive.run(CONTROLLED_FROM + 60 * MILLISECOND)
        return session.executive.statistics
    finally:
        sys.setprofile(None)
        session.close()


def too_many(ticks: Sequence[Counter[str]], most: int) -> list[int]:
    return [each.total() for each in ticks if each.total() > most]


def test_a_control_tick_takes_few_calls_in_few_files(tmp_path: Path) -> None:
    clock = InVirtualTime()
    clock.count(CONTROLLED_FROM, file_of_ours)
    ticks_of(clock, tmp_path)
    ticks = clock.passes[:5]
    assert too_many(ticks, MOST_CALLS) == []
    assert [len(each) for each in ticks if len(each) > MOST_FILES] == []
    # the domain's own path is among them: a tick that reads no chip is none
    for file in ("imu.py", "mpu9250.py", "attitude.py", "pid.py", "allocation.py", "pca9685.py"):
        assert all(any(Path(name).name == file for name in tick) for tick in ticks)


@pytest.mark.real_time
def test_a_late_one_takes_few_more_and_names_its_cause_in_slack(tmp_path: Path) -> None:
    clock = InRealTime()
    clock.count(CONTROLLED_FROM, file_of_ours)
    statistics = ticks_of(clock, tmp_path)
    ticks = clock.passes[2:5]  # what came before them may have been late, too
    assert too_many(ticks, MOST_CALLS + MOST_WHEN_LATE) == []
    assert any(Path(name).name == "blamer.py" for tick in ticks for name in tick)
    counted = statistics.figures().late_by_cause
    assert counted is not None
    assert sum(counted.values()) > 0


def test_a_recorded_tick_takes_a_call_for_each_thing_recorded_and_one_to_write(
    tmp_path: Path,
) -> None:
    clock = CountingClock(CONTROLLED_FROM, function_of_blackbox)
    ticks_of(clock, tmp_path)
    assert clock.passes[:4] == [Counter(RECORDED)] * 4
